// Runs the program itself: exit codes, one-line messages, nothing overwritten, JSON alone on standard output,
// nothing left behind by an interruption. Pictures: cli_render_test; volumes: cli_build_test.
#define BOOST_TEST_MODULE cli
#include <boost/test/unit_test.hpp>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;
namespace fs = std::filesystem;

namespace {

const std::vector<std::string> kCommands{
    "devices", "simulate", "info",   "reconstruct",      "plan", "build", "verify",
    "probe",   "render",   "export", "convert-geometry", "run",  "bench"};

/// The words of each command that reads a file, with that file in the place of IN.
std::vector<std::vector<std::string>> readers(const std::string& input) {
  const std::string points = at("points.csv");
  write(points, "x,y,z\n0,0,0\n");
  return {{"info", input},
          {"reconstruct", input, "-o", at("o.mha")},
          {"plan", input, "--epsilon", "3%"},
          {"build", input, "--epsilon", "3%", "-o", at("o.vdvr")},
          {"verify", input, "--projections", input},
          {"probe", input, "--exact", "--points", points, "-o", at("o.csv")},
          {"render", input, "-o", at("o.png")},
          {"export", input, "-o", at("o.mha")},
          {"convert-geometry", input, "-o", at("o.xml")},
          {"run", input, "--epsilon", "3%", "-o", at("o.dir")},
          {"simulate", "--volume", input, "-o", at("o.h5")},
          {"bench", "build", input, "--epsilon", "3%"},
          {"bench", "render", input}};
}

}  // namespace

BOOST_AUTO_TEST_CASE(version_and_overview_are_printed) {
  const Ended version = run({"--version"});
  BOOST_TEST(version.code == 0);
  BOOST_TEST(version.out.rfind("vdvr ", 0) == 0);
  const Ended overview = run({"--help"});
  BOOST_TEST(overview.code == 0);
  for (const auto& command : kCommands) BOOST_TEST(overview.out.find("  " + command) != std::string::npos);
}

BOOST_AUTO_TEST_CASE(every_command_explains_itself) {
  for (const auto& command : kCommands) {
    const Ended r = run({command, "--help"});
    BOOST_TEST(r.code == 0);
    BOOST_TEST(r.out.rfind("usage: vdvr " + command, 0) == 0);
    BOOST_TEST(r.err.empty());
  }
}

BOOST_AUTO_TEST_CASE(scan_of_more_than_an_eighth_of_the_limit_goes_to_scratch_and_leaves_nothing) {
  const std::string scan = at("scratch.h5"), folder = at("scratch"), volume = folder + "/o.mha";
  BOOST_REQUIRE(run({"simulate", "--phantom", "sphere", "--detector", "64x64", "--angles", "200", "--point",
                     "-o", scan})
                    .code == 0);
  fs::create_directory(folder);
  // Where scratch cannot be made, it is not made: so it was asked for.
  const Ended refused =
      run({"reconstruct", scan, "--max-memory", "24M", "--scratch", at("nowhere"), "-o", volume});
  BOOST_TEST(refused.code == 3);
  BOOST_TEST(refused.err.find("--scratch") != std::string::npos, refused.err);
  const Ended made = run({"reconstruct", scan, "--max-memory", "24M", "--scratch", ".", "-o", volume});
  BOOST_TEST(made.code == 0, made.err);
  std::vector<std::string> left;
  for (const auto& entry : fs::directory_iterator(folder)) left.push_back(entry.path().filename().string());
  BOOST_TEST(left == std::vector<std::string>{"o.mha"}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(unknown_words_are_refused_in_one_line) {
  BOOST_TEST(run({"frobnicate"}).code == 2);
  for (const auto& command : kCommands) {
    const Ended r = run({command, "--frobnicate"});
    BOOST_TEST(r.code == 2);
    BOOST_TEST(is_one_line(r.err));
    BOOST_TEST(r.err.find("frobnicate") != std::string::npos);
  }
  check_refused({"info", "a", "b"}, "too many");
  check_refused({"info"}, "FILE is missing");
}

BOOST_AUTO_TEST_CASE(bad_numbers_are_refused_by_option) {
  const std::string o = at("bad.vdvr");
  check_refused({"plan", "x.h5"}, "--epsilon");
  check_refused({"plan", "x.h5", "--epsilon", "3"}, "3%");
  check_refused({"plan", "x.h5", "--epsilon", "-3%"}, "--epsilon");
  check_refused({"plan", "x.h5", "--epsilon", "nan"}, "--epsilon");
  check_refused({"plan", "x.h5", "--epsilon", "3%", "--epsilon-abs", "1"}, "--epsilon");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--size", "4x4"}, "--size");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--size", "4x0x4"}, "--size");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--size", "99999999999999999999x4x4"},
                "--size");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--origin", "-1,-2"}, "--origin");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--compression", "zip"}, "--compression");
  check_refused({"plan", "x.h5", "--epsilon", "3%", "--compression", "none"}, "--compression");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--granularity", "3"}, "--granularity");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--upsampling", "3"}, "--upsampling");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--max-memory", "lots"}, "--max-memory");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--filter", "none"}, "--filter");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--storage", "u32"}, "--storage");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--closing", "fine"}, "--closing");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--levels", "none"}, "--levels");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--closing", "paper", "--coefficients",
                 "sampled", "--levels", "anisotropic"},
                "--levels isotropic");
}

BOOST_AUTO_TEST_CASE(missing_input_is_refused) {
  for (const auto& words : readers(at("does-not-exist.h5"))) check_refused(words, "does-not-exist.h5");
}

BOOST_AUTO_TEST_CASE(empty_input_is_refused) {
  for (const std::string name : {"empty.h5", "empty.vdvr", "empty.mha"}) {
    write(at(name), "");
    for (const auto& words : readers(at(name))) check_refused(words, name);
  }
}

BOOST_AUTO_TEST_CASE(input_of_another_kind_is_refused) {
  for (const std::string name : {"text.h5", "text.vdvr", "text.mha", "text.png"}) {
    write(at(name), "This is a letter, not a measurement.\n");
    for (const auto& words : readers(at(name))) check_refused(words, name);
  }
}

BOOST_AUTO_TEST_CASE(truncated_input_is_refused) {
  const std::string whole = bytes_of(small_scan());
  for (const std::string name : {"half.h5", "half.vdvr"}) {
    write(at(name), whole.substr(0, whole.size() / 2));
    for (const auto& words : readers(at(name))) check_refused(words, name);
  }
}

BOOST_AUTO_TEST_CASE(refusals_leave_no_output_behind) {
  for (const std::string name : {"o.mha", "o.vdvr", "o.csv", "o.png", "o.dir", "o.h5", "o.xml"})
    BOOST_TEST(!fs::exists(at(name)));
  check_no_temporary_file_is_left();
}

BOOST_AUTO_TEST_CASE(nothing_is_overwritten_without_force) {
  const std::string scan = small_scan();
  const std::string before = bytes_of(scan);
  check_refused({"simulate", "--phantom", "sphere", "-o", scan}, "--force");
  write(at("kept.mha"), "kept");
  check_refused({"reconstruct", scan, "-o", at("kept.mha")}, "--force");
  write(at("kept.vdvr"), "kept");
  check_refused({"build", scan, "--epsilon", "3%", "-o", at("kept.vdvr")}, "--force");
  fs::create_directories(at("kept.dir"));
  write(at("kept.dir/certificate.json"), "kept");
  check_refused({"run", scan, "--epsilon", "3%", "-o", at("kept.dir")}, "--force");
  BOOST_TEST(bytes_of(scan) == before);
  BOOST_TEST(bytes_of(at("kept.mha")) == "kept");
  BOOST_TEST(bytes_of(at("kept.vdvr")) == "kept");
  BOOST_TEST(bytes_of(at("kept.dir/certificate.json")) == "kept");
}

BOOST_AUTO_TEST_CASE(an_input_is_never_the_output) {
  const std::string scan = small_scan();
  const std::string before = bytes_of(scan);
  check_refused({"build", scan, "--epsilon", "3%", "-o", scan, "--force"}, "also the input");
  BOOST_TEST(bytes_of(scan) == before);
}

BOOST_AUTO_TEST_CASE(json_stands_alone_on_standard_output) {
  const std::string scan = small_scan();
  const std::string volume = at("json.vdvr");
  const std::vector<std::vector<std::string>> calls{
      {"devices"},
      {"info", scan},
      {"reconstruct", scan, "-o", at("json.mha"), "--upsampling", "2"},
      {"info", at("json.mha")},
      {"plan", scan, "--epsilon", "20%"},
      {"build", scan, "--epsilon", "20%", "-o", volume},
      {"info", volume},
      {"verify", volume, "--projections", scan},
      {"export", volume, "-o", at("json-export.mha")},
      {"render", volume, "-o", at("json.png"), "--size", "32x32"},
      {"render", volume, "-o", at("json-error.png"), "--mode", "error", "--projections", scan, "--size",
       "256x256"}};
  for (auto words : calls) {
    words.emplace_back("--json");
    const Ended r = run(words);
    BOOST_TEST_CONTEXT("vdvr " << words[0] << " said: " << r.err) {
      BOOST_TEST(r.code == 0);
      BOOST_TEST(nlohmann::json::parse(r.out, nullptr, false).is_object());
    }
  }
}

BOOST_AUTO_TEST_CASE(interruption_leaves_nothing_behind) {
  const std::string scan = small_scan(), file = at("interrupted"), dir = at("interrupted.dir");
  const std::vector<std::vector<std::string>> calls{
      {"simulate", "--phantom", "sphere", "--detector", "257x257", "--angles", "720", "-o", file + ".h5"},
      {"reconstruct", scan, "--size", "256x256x64", "-o", file + ".mha"},
      {"build", scan, "--epsilon", "3%", "-o", file + ".vdvr"},
      {"run", scan, "--epsilon", "3%", "-o", dir}};
  for (const auto& words : calls) {
    for (const int signal : {SIGINT, SIGTERM}) {
      const pid_t child = start(words);
      // The first line of progress is the sign that work has begun.
      wait_for("");
      ::kill(child, signal);
      const Ended r = finish(child);
      BOOST_TEST_CONTEXT("vdvr " << words[0] << " said: " << r.err) {
        BOOST_TEST(r.code == 128 + signal);
        BOOST_TEST(!fs::exists(words.back()));
      }
    }
  }
  check_no_temporary_file_is_left();
}

BOOST_AUTO_TEST_CASE(exports_say_what_they_wrote_and_refuse_what_does_not_fit) {
  const std::string& volume = small_volume();
  check_refused({"export", volume, "-o", at("x")}, "--format");
  check_refused({"export", volume, "-o", at("x.txt")}, "--format");
  check_refused({"export", volume, "-o", at("x.vtm"), "--oversampling", "2"}, "--oversampling");
  check_refused({"export", volume, "-o", at("x.mha"), "--compression", "none"}, "--compression");
  check_refused({"export", volume, "-o", at("x.mha"), "--blocks", "9"}, "--blocks");
  check_refused({"export", volume, "-o", at("x.mha"), "--format", "npy"}, "--format");
  check_refused({"export", volume, "-o", at("x.zarr"), "--samples", "u8"}, "x.zarr");
  check_refused({"export", volume, "-o", at("x.npy"), "--range", "0,1"}, "--range");
  check_refused({"export", volume, "-o", at("x.tif"), "--samples", "u8", "--range", "1,0"}, "--range");
  check_refused({"export", small_scan(), "-o", at("x.tif")}, "not a certified volume");
  for (const std::string name : {"e.vtm", "e.zarr", "e.tif", "slices"}) {
    std::vector<std::string> words{"export", volume, "-o", at(name), "--json"};
    if (name == "slices") words.insert(words.end(), {"--format", "tiff"});
    const Ended first = run(words);
    BOOST_TEST_CONTEXT(name << ": " << first.err) {
      BOOST_REQUIRE(first.code == 0);
      const auto json = nlohmann::json::parse(first.out);
      BOOST_TEST(json.at("output") == at(name));
      BOOST_TEST(json.at("samples") > 0);
      BOOST_TEST(json.at("bytes") > 0);
    }
    check_refused(words, "--force");
    words.push_back("--force");
    BOOST_TEST(run(words).code == 0);
  }
  // What somebody else put into a folder stays there.
  write(at("slices") + "/mine.txt", "mine");
  check_refused({"export", volume, "-o", at("slices"), "--format", "tiff", "--force"}, "mine.txt");
  BOOST_TEST(bytes_of(at("slices") + "/mine.txt") == "mine");
  check_no_temporary_file_is_left();
}
