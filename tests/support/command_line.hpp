// What the tests of the command line share: one folder per test program, the program run in it, and what each
// refusal must look like. Used by tests/cli_*test.cpp.
#pragma once

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/program.hpp"

namespace vdvr::support {

/// The folder of this test program, removed at its end.
inline const TemporaryFolder& folder() {
  static const TemporaryFolder one;
  return one;
}
inline std::string at(const std::string& name) { return (folder() / name).string(); }
inline void write(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Starts the program; the child's id. `err` of an earlier call is emptied before it can be taken for this
/// one's.
inline pid_t start(const std::vector<std::string>& words) {
  write(at("std.err"), "");
  return Program(folder().path()).start(words);
}
inline Ended finish(pid_t child) { return Program(folder().path()).finish(child); }
inline Ended run(const std::vector<std::string>& words) { return finish(start(words)); }

/// Waits until the running program says `text` on stderr, or says anything where it is empty.
inline void wait_for(const std::string& text, std::chrono::seconds most = std::chrono::seconds(60)) {
  const auto end = std::chrono::steady_clock::now() + most;
  while (std::chrono::steady_clock::now() < end) {
    const std::string said = bytes_of(at("std.err"));
    if (!said.empty() && said.find(text) != std::string::npos) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

inline bool is_one_line(const std::string& text) {
  return !text.empty() && text.back() == '\n' && std::count(text.begin(), text.end(), '\n') == 1;
}

/// The last line says what is wrong; progress lines of stages may stand before it.
inline std::string last_line(const std::string& text) {
  const std::size_t end = text.empty() ? 0 : text.size() - 1;
  const std::size_t begin = text.rfind('\n', end == 0 ? 0 : end - 1);
  return text.substr(begin == std::string::npos ? 0 : begin + 1);
}

inline void check_refused(const std::vector<std::string>& words, const std::string& named = "") {
  const Ended r = run(words);
  BOOST_TEST_CONTEXT("vdvr " << words[0] << " ... " << words.back() << " said: " << r.err) {
    BOOST_TEST(r.code == 2);
    BOOST_TEST(r.out.empty());
    BOOST_TEST(last_line(r.err).rfind("vdvr " + words[0] + ": ", 0) == 0);
    BOOST_TEST(r.err.find(named) != std::string::npos);
  }
}

inline void check_no_temporary_file_is_left() {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder().path()))
    BOOST_TEST(entry.path().filename().string()[0] != '.', "temporary file left: " << entry.path());
}

/// Ctrl-C once the program says `stage`: code 130, and none of these files of the test's folder is there.
inline void check_interrupted(const std::vector<std::string>& words, const std::string& stage,
                              const std::vector<std::string>& files) {
  const pid_t child = start(words);
  wait_for(stage);
  ::kill(child, SIGINT);
  const Ended r = finish(child);
  BOOST_TEST(r.code == 130, r.err);
  for (const std::string& file : files)
    BOOST_TEST(!std::filesystem::exists(at(file)), file << " was left behind");
  check_no_temporary_file_is_left();
}
/// What a certified picture X.png has beside it.
inline std::vector<std::string> with_certificate(const std::string& x) {
  return {x + ".png", x + ".bound.png", x + ".certificate.json"};
}

/// A small scan of a sphere, made once.
inline const std::string& small_scan() {
  static const std::string path = [] {
    const std::string file = at("sphere.h5");
    const Ended r = run(
        {"simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "48", "-o", file, "--force"});
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return file;
  }();
  return path;
}

/// The certified volume of that scan, made once.
inline const std::string& small_volume() {
  static const std::string path = [] {
    const std::string file = at("sphere.vdvr");
    const Ended r = run({"build", small_scan(), "--epsilon", "20%", "-o", file});
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return file;
  }();
  return path;
}

}  // namespace vdvr::support
