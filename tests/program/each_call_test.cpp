// Every OpenCL function fails in turn, at its first call and in the middle, once or for good: each command
// ends well in spite of it, or with exit code 3 and the device named, and leaves nothing half-written. Then a
// sick platform or device among healthy ones, which ends nobody's work.
#define BOOST_TEST_MODULE each_call
#include <boost/test/unit_test.hpp>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/support/program.hpp"

namespace fs = std::filesystem;
using namespace vdvr::support;

namespace {

using Words = std::vector<std::string>;

/// A scan and its certified volume, once for all tests.
struct Inputs {
  TemporaryFolder folder;
  std::string scan = (folder / "scan.h5").string(), volume = (folder / "in.vdvr").string(), name;
  Inputs() {
    const Program program(folder.path());
    for (const Words& words :
         {Words{"simulate", "--phantom", "sphere", "--detector", "17x5", "--angles", "24", "-o", scan},
          Words{"build", scan, "--epsilon", "8%", "-o", volume}}) {
      const Ended made = program.run(words);
      BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
    }
    const Ended devices = program.run({"devices", "--json"});
    name = nlohmann::json::parse(devices.out)["devices"][0]["name"].get<std::string>();
  }
};
const Inputs& inputs() {
  static const Inputs one;
  return one;
}

Program faulty(const fs::path& folder) {
  Program program(folder);
  program.environment["LD_PRELOAD"] = VDVR_OPENCL_FAULTS;
  // A test of the device that is remembered would be fewer calls.
  program.environment["VDVR_CACHE"] = "off";
  // Nothing here takes a minute: a command that hangs is killed, which no exit code is.
  program.prepare = [] { ::alarm(300); };
  return program;
}

/// How often each function is called.
std::map<std::string, unsigned long> calls_of(const Words& words, const fs::path& folder) {
  Program program = faulty(folder);
  const fs::path file = folder / "std.counts";
  program.environment["VDVR_FAULTS_COUNT"] = file.string();
  const Ended ended = program.run(words);
  BOOST_REQUIRE_MESSAGE(ended.code == 0, ended.err);
  std::istringstream lines(bytes_of(file));
  std::map<std::string, unsigned long> calls;
  for (std::string name; lines >> name;) lines >> calls[name];
  return calls;
}

bool is_whole_or_absent(const fs::path& folder, const Ended& ended, const fs::path& output) {
  if (ended.code == 0) return output.empty() || fs::exists(output);
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && !name.starts_with("std.") && !name.ends_with(".journal")) return false;
  }
  return true;
}

void clear(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder))
    if (!entry.path().filename().string().starts_with("std.")) fs::remove_all(entry.path());
}

/// `words` with each function failing at some of its calls, the device lost afterwards or not.
void fail_each(const Words& words, const fs::path& output, const TemporaryFolder& folder) {
  int failed = 0;
  for (const auto& [name, count] : calls_of(words, folder.path())) {
    clear(folder.path());
    for (const auto& [number, lost] : std::set<std::pair<unsigned long, bool>>{
             {1, false}, {(count + 1) / 2, false}, {(count + 1) / 2, name.starts_with("clEnqueue")}}) {
      Program program = faulty(folder.path());
      program.environment["VDVR_FAULTS_FAIL"] = name + ":" + std::to_string(number);
      if (lost) program.environment["VDVR_FAULTS_LOST"] = "1";
      const Ended ended = program.run(words);
      BOOST_TEST_CONTEXT("vdvr " << words[0] << ", " << name << " fails at call " << number << " of " << count
                                 << (lost ? ", and all after it" : "") << ": " << ended.code << " "
                                 << ended.err) {
        BOOST_TEST((ended.code == 0 || ended.code == 3));
        BOOST_TEST(is_whole_or_absent(folder.path(), ended, output));
        if (ended.code != 0) {
          ++failed;
          BOOST_TEST(ended.err.find("vdvr " + words[0] + ": ") != std::string::npos);
          BOOST_TEST((ended.err.find(inputs().name) != std::string::npos ||
                      ended.err.find("device") != std::string::npos));
        }
      }
      clear(folder.path());
    }
  }
  BOOST_TEST(failed >= 20);
}

}  // namespace

BOOST_AUTO_TEST_CASE(each_call_of_a_picture_fails_in_turn) {
  const TemporaryFolder folder;
  const fs::path out = folder / "o.png";
  fail_each({"render", inputs().volume, "--size", "16x16", "--sampler", "buffer", "-o", out.string()}, out,
            folder);
}

BOOST_AUTO_TEST_CASE(each_call_of_a_verification_fails_in_turn) {
  const TemporaryFolder folder;
  fail_each({"verify", inputs().volume, "--projections", inputs().scan}, {}, folder);
}

BOOST_AUTO_TEST_CASE(each_call_of_a_build_fails_in_turn) {
  const TemporaryFolder folder;
  const fs::path out = folder / "o.vdvr";
  fail_each({"build", inputs().scan, "--epsilon", "8%", "-o", out.string()}, out, folder);
}

BOOST_AUTO_TEST_CASE(a_sick_device_is_listed_with_its_trouble) {
  const TemporaryFolder folder;
  for (const char* call :
       {"clGetDeviceIDs:1", "clGetDeviceInfo:3", "clGetPlatformInfo:1", "clCreateContext:1"}) {
    Program program = faulty(folder.path());
    program.environment["VDVR_FAULTS_FAIL"] = call;
    const Ended ended = program.run({"devices"});
    BOOST_TEST(ended.code == 0, call << ": " << ended.err);
    BOOST_TEST(ended.out.find("cannot be used: ") != std::string::npos, call << ": " << ended.out);
  }
}
