// Every OpenCL function fails in turn, in the middle of its calls, those that enqueue for good: each command
// ends well in spite of it, or with exit code 3 and the device named, and leaves nothing half-written. Then a
// sick platform or device among healthy ones, which ends nobody's work. VDVR_EACH_CALL=all fails five calls
// of each, once and for good.
#define BOOST_TEST_MODULE each_call
#include <boost/test/unit_test.hpp>
#include <cstdlib>
#include <functional>
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

/// VDVR_EACH_CALL=all: more calls of each function, of every command. Takes some minutes.
bool takes_all() {
  const char* wanted = std::getenv("VDVR_EACH_CALL");
  return wanted != nullptr && std::string(wanted) == "all";
}

Program faulty(const fs::path& folder) {
  Program program(folder);
  program.environment["LD_PRELOAD"] = VDVR_OPENCL_FAULTS;
  // A command that hangs is killed, which no exit code is.
  program.prepare = [] { ::alarm(300); };
  return program;
}

using Calls = std::map<std::string, unsigned long>;
/// How often each function is called.
Calls calls_of(Program program, const Words& words, const fs::path& folder) {
  const fs::path file = folder / "std.counts";
  program.environment["VDVR_FAULTS_COUNT"] = file.string();
  const Ended ended = program.run(words);
  BOOST_REQUIRE_MESSAGE(ended.code == 0, ended.err);
  std::istringstream lines(bytes_of(file));
  Calls calls;
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

/// Which calls fail, and whether the device is lost with them.
std::set<std::pair<unsigned long, bool>> failing(const std::string& name, unsigned long count) {
  std::set<std::pair<unsigned long, bool>> places{{(count + 1) / 2, name.starts_with("clEnqueue")}};
  if (!takes_all()) return places;
  for (const unsigned long part : {0ul, 1ul, 2ul, 3ul, 4ul})
    for (const bool lost : {false, true}) places.insert({1 + part * (count - 1) / 4, lost});
  return places;
}

struct Attack {
  Words words;
  fs::path output;
  /// Of which functions, so that commands that take seconds share them.
  std::function<bool(std::size_t place, const std::string& name)> takes;
  bool remembers = true;  ///< the device's test, which is many calls itself
};

/// A command with each function failing.
void fail_each(const Attack& attack, const TemporaryFolder& folder) {
  Program program = faulty(folder.path());
  if (!attack.remembers) program.environment["VDVR_CACHE"] = "off";
  const std::string& command = attack.words[0];
  std::size_t place = 0;
  int failed = 0, tried = 0;
  for (const auto& [name, count] : calls_of(program, attack.words, folder.path())) {
    clear(folder.path());
    if (!takes_all() && !attack.takes(place++, name)) continue;
    for (const auto& [number, lost] : failing(name, count)) {
      Program now = program;
      now.environment["VDVR_FAULTS_FAIL"] = name + ":" + std::to_string(number);
      if (lost) now.environment["VDVR_FAULTS_LOST"] = "1";
      const Ended ended = now.run(attack.words);
      ++tried;
      BOOST_TEST_CONTEXT("vdvr " << command << ", " << name << " fails at call " << number << " of " << count
                                 << (lost ? ", and all after it" : "") << ": " << ended.code << " "
                                 << ended.err) {
        BOOST_TEST((ended.code == 0 || ended.code == 3));
        BOOST_TEST(is_whole_or_absent(folder.path(), ended, attack.output));
        if (ended.code != 0) {
          ++failed;
          BOOST_TEST(ended.err.find("vdvr " + command + ": ") != std::string::npos);
          // Kernels that cannot be made are named themselves, devices that cannot be described by number.
          BOOST_TEST((ended.err.find(inputs().name) != std::string::npos ||
                      ended.err.find("kernel ") != std::string::npos ||
                      ended.err.find("device 0, '") != std::string::npos ||
                      ended.err.find("no OpenCL device found") != std::string::npos));
        }
      }
      clear(folder.path());
    }
  }
  BOOST_TEST_MESSAGE(command << ": " << failed << " of " << tried << " failed");
  BOOST_TEST(failed >= tried / 3);
}

/// What opening a device calls as well is failed there.
bool is_of_opening(const std::string& name) {
  static const std::set<std::string> names{"clCreateCommandQueue",
                                           "clCreateContext",
                                           "clGetDeviceIDs",
                                           "clGetDeviceInfo",
                                           "clGetPlatformIDs",
                                           "clGetPlatformInfo",
                                           "clGetSupportedImageFormats",
                                           "clReleaseCommandQueue",
                                           "clReleaseContext",
                                           "clReleaseDevice",
                                           "clRetainDevice"};
  return names.count(name) != 0;
}

}  // namespace

BOOST_AUTO_TEST_CASE(each_call_of_opening_and_testing_a_device_fails_in_turn) {
  const TemporaryFolder folder;
  fail_each({{"devices", "--device", "0"}, {}, [](std::size_t, const std::string&) { return true; }, false},
            folder);
}

BOOST_AUTO_TEST_CASE(each_call_of_a_picture_fails_in_turn) {
  const TemporaryFolder folder;
  const fs::path out = folder / "o.png";
  fail_each({{"render", inputs().volume, "--size", "16x16", "--sampler", "buffer", "-o", out.string()},
             out,
             [](std::size_t, const std::string& name) { return !is_of_opening(name); }},
            folder);
}

BOOST_AUTO_TEST_CASE(each_call_of_a_verification_fails_in_turn) {
  const TemporaryFolder folder;
  fail_each({{"verify", inputs().volume, "--projections", inputs().scan},
             {},
             [](std::size_t i, const std::string& name) { return !is_of_opening(name) && i % 2 == 0; }},
            folder);
}

BOOST_AUTO_TEST_CASE(each_call_of_a_build_fails_in_turn) {
  const TemporaryFolder folder;
  const fs::path out = folder / "o.vdvr";
  fail_each({{"build", inputs().scan, "--epsilon", "8%", "-o", out.string()},
             out,
             [](std::size_t i, const std::string& name) { return !is_of_opening(name) && i % 2 == 1; }},
            folder);
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
