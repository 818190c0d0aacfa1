// `vdvr-paper` given what it cannot use, and interrupted: refused before minutes of work, and no half
// of a report. What a whole report holds: paper_test.
#define BOOST_TEST_MODULE paper_cli
#include <boost/test/unit_test.hpp>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;
namespace fs = std::filesystem;

namespace {

std::vector<std::string> paper(const std::vector<std::string>& more) {
  std::vector<std::string> words{"--quick"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

Program program() {
  Program p(folder().path());
  p.binary = VDVR_PAPER_BINARY;
  return p;
}

/// Refused in one line, so before the first stage reports.
void check_refused_at_once(const std::vector<std::string>& more, const std::string& named) {
  const Ended r = program().run(paper(more));
  BOOST_TEST_CONTEXT("vdvr-paper said: " << r.err) {
    BOOST_TEST(r.code == 2);
    BOOST_TEST(r.out.empty());
    BOOST_TEST(r.err.rfind("vdvr-paper: ", 0) == 0);
    BOOST_TEST(r.err.find(named) != std::string::npos);
    BOOST_TEST(is_one_line(r.err));
  }
}

/// Runs until `stage` begins, then sends the signal.
void check_interrupted(const std::vector<std::string>& more, const std::string& stage, int signal) {
  write(at("std.err"), "");
  const pid_t child = program().start(paper(more));
  wait_for("vdvr-paper: " + stage + "\n");
  ::kill(child, signal);
  const Ended r = program().finish(child);
  BOOST_TEST_CONTEXT(stage << ", signal " << signal << ": " << r.err) {
    BOOST_TEST(r.code == 128 + signal);
    BOOST_TEST(r.out.empty());
    BOOST_TEST(last_line(r.err) == "vdvr-paper: interrupted\n");
  }
  check_no_temporary_file_is_left();
}

}  // namespace

BOOST_AUTO_TEST_CASE(unknown_options_and_stray_words_are_refused) {
  check_refused_at_once({"-o", at("x"), "--frobnicate"}, "--frobnicate");
  check_refused_at_once({"-o", at("x"), "--frobnicate"}, "vdvr-paper --help");
  check_refused_at_once({"-o", at("x"), "stray"}, "too many");
  check_refused_at_once({"-o", at("x"), "--max-memory", "lots"}, "--max-memory");
  BOOST_TEST(program().run(paper({"-o", at("x"), "--device", "no such device"})).code == 3);
  BOOST_TEST(!fs::exists(at("x")));
}

BOOST_AUTO_TEST_CASE(the_program_explains_itself) {
  const Ended r = program().run({"--help"});
  BOOST_TEST(r.code == 0);
  BOOST_TEST(r.out.rfind("usage: vdvr-paper ", 0) == 0);
  for (const char* option : {"--output", "--quick", "--head", "--force"})
    BOOST_TEST(r.out.find(option) != std::string::npos, option);
}

BOOST_AUTO_TEST_CASE(the_library_s_command_line_has_no_such_case_any_more) {
  check_refused({"bench", "paper", "-o", at("x")}, "vdvr-paper");
}

BOOST_AUTO_TEST_CASE(a_report_without_a_folder_is_refused) {
  check_refused_at_once({}, "--output is missing");
  check_refused_at_once({"-o", ""}, "--output");
}

BOOST_AUTO_TEST_CASE(a_head_that_cannot_be_read_is_refused_before_anything_is_measured) {
  const std::string letter = "This is a letter, not a head.\n";
  for (const char* name : {"letter.txt", "letter.mha", "letter.nrrd", "letter.tif"}) {
    write(at(name), letter);
    check_refused_at_once({"-o", at("x"), "--head", at(name)}, name);
  }
  check_refused_at_once({"-o", at("x"), "--head", at("absent.mha")}, "absent.mha");
  check_refused_at_once({"-o", at("x"), "--head", at("absent.mha")}, "scripts/fetch-head");
  fs::create_directories(at("folder"));
  check_refused_at_once({"-o", at("x"), "--head", at("folder")}, "--head");
  // A header that promises samples which are not there.
  write(at("short.mha"),
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 8 8 8\nElementType = MET_FLOAT\n"
        "ElementDataFile = LOCAL\nfew");
  check_refused_at_once({"-o", at("x"), "--head", at("short.mha")}, "short.mha");
  BOOST_TEST(!fs::exists(at("x")));
}

BOOST_AUTO_TEST_CASE(a_file_in_the_place_of_the_folder_is_refused_and_kept) {
  write(at("occupied"), "kept");
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"-o", at("occupied")}, {"-o", at("occupied"), "--force"}})
    check_refused_at_once(more, "occupied: is a file");
  check_refused_at_once({"-o", at("occupied") + "/below"}, "occupied");
  BOOST_TEST(bytes_of(at("occupied")) == "kept");
}

BOOST_AUTO_TEST_CASE(no_file_of_an_earlier_report_is_overwritten_without_force) {
  for (const std::string name :
       {"paper.json", "paper.html", "claims.csv", "figure-13-1.png", "figure-12-field.npy", "figure-3.svg"}) {
    const std::string place = "report of " + name;
    fs::create_directories(at(place));
    write(at(place) + "/" + name, "kept");
    check_refused_at_once({"-o", at(place)}, name + ": exists already; --force");
    BOOST_TEST(bytes_of(at(place) + "/" + name) == "kept");
  }
}

BOOST_AUTO_TEST_CASE(interruption_leaves_no_report) {
  for (const int signal : {SIGINT, SIGTERM}) {
    check_interrupted({"-o", at("interrupted")}, "figure 3", signal);
    BOOST_TEST(!fs::exists(at("interrupted")));
  }
}

BOOST_AUTO_TEST_CASE(interruption_keeps_what_lay_in_the_folder) {
  const std::string place = at("older");
  fs::create_directories(place);
  write(place + "/paper.json", "older");
  write(place + "/notes.txt", "mine");
  check_interrupted({"-o", place, "--force"}, "plan", SIGINT);
  BOOST_TEST(bytes_of(place + "/paper.json") == "older");
  BOOST_TEST(bytes_of(place + "/notes.txt") == "mine");
  BOOST_TEST(std::distance(fs::directory_iterator(place), fs::directory_iterator()) == 2);
}
