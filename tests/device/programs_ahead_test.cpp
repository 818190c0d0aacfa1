// Programs that a process asked for are built ahead in the next one, and nothing depends on it.
#define BOOST_TEST_MODULE programs_ahead
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "host/base/opencl/kernel.hpp"
#include "host/base/system/cache_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/device.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;
const std::string purpose = "a test";
const opencl::Defines product{{"VDVR_LANES", "4"}, {"VDVR_RUN", "4"}};

// A cache folder of one's own, and whether this device is one for which programs are built ahead.
struct OwnCache {
  bool for_this_device = false;
  OwnCache() {
    static const support::TemporaryFolder folder;  // PoCL, which has its cache there too, asks once
    setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
    fs::remove_all(cache_folder() / "programs");
    const Device device;
    for_this_device = device.info().platform == "Portable Computing Language";
  }
  [[nodiscard]] std::vector<fs::path> lists() const {
    std::vector<fs::path> out;
    const fs::path programs = cache_folder() / "programs";
    if (fs::exists(programs))
      for (const auto& entry : fs::directory_iterator(programs)) out.push_back(entry.path());
    return out;
  }
  [[nodiscard]] std::string list() const {
    std::ifstream in(lists().at(0));
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& text) const { std::ofstream(lists().at(0)) << text; }
};

void ask(Device& device) {
  device.build_ahead(purpose);
  opencl::program(device.state(), "field/fbp/batched_product", product);
}

// Programs that are there after at most ten seconds without being asked for.
std::size_t built_unasked(std::size_t wanted) {
  Device device;
  const std::size_t before = device.state().programs();
  device.build_ahead(purpose);
  std::size_t built = 0;
  for (int i = 0; i < 1000 && built < wanted; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    built = device.state().programs() - before;
  }
  return built;
}

BOOST_FIXTURE_TEST_CASE(what_was_asked_for_is_built_next_time_before_it_is_asked_for, OwnCache) {
  {
    Device device;
    ask(device);
  }
  BOOST_TEST(lists().size() == (for_this_device ? 1U : 0U));
  if (!for_this_device) return;
  const std::string noted = list();
  BOOST_TEST(noted.find("\nfield/fbp/batched_product VDVR_LANES=4 VDVR_RUN=4\nend\n") != std::string::npos,
             noted);
  BOOST_TEST(built_unasked(1) == 1U);
  // A process that asked for nothing leaves the list.
  BOOST_TEST(list() == noted);
}

BOOST_FIXTURE_TEST_CASE(another_purpose_has_a_list_of_its_own, OwnCache) {
  if (!for_this_device) return;
  {
    Device device;
    ask(device);
  }
  Device device;
  device.build_ahead("another");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  BOOST_TEST(device.state().programs() == 0U);
}

BOOST_FIXTURE_TEST_CASE(a_list_that_names_what_is_wrong_changes_nothing, OwnCache) {
  if (!for_this_device) return;
  {
    Device device;
    ask(device);
  }
  const std::string good = list(), head = good.substr(0, good.find('\n') + 1);
  const std::vector<std::string> bad{"",
                                     "end\n",
                                     good.substr(0, good.size() - 5),
                                     good.substr(3),
                                     std::string(1000, '\xff'),
                                     head + "no/such/program\nend\n",
                                     head + "../../etc/passwd\nend\n",
                                     head + "field/fbp/batched_product VDVR_LANES=4 -Dfloat=int\nend\n",
                                     head + "field/fbp/batched_product VDVR_LANES=three VDVR_RUN=4\nend\n",
                                     head + "\n\n \nend\n"};
  for (const std::string& text : bad) {
    write(text);
    Device device;
    ask(device);
    BOOST_TEST(device.state().programs() >= 1U);
    const opencl::Defines missing{};
    BOOST_CHECK_THROW(opencl::program(device.state(), "no/such/program", missing), BuildError);
  }
  // And what was asked for is noted again.
  BOOST_TEST(list() == good);
}

BOOST_FIXTURE_TEST_CASE(a_process_may_end_while_programs_are_built, OwnCache) {
  if (!for_this_device) return;
  {
    Device device;
    ask(device);
    for (const char* run : {"2", "8"})
      opencl::program(device.state(), "field/fbp/batched_product", {{"VDVR_LANES", "8"}, {"VDVR_RUN", run}});
  }
  for (int i = 0; i < 20; ++i) {
    Device device;
    device.build_ahead(purpose);
    std::this_thread::sleep_for(std::chrono::milliseconds(3 * i));
  }
  BOOST_TEST(built_unasked(3) == 3U);
}

}  // namespace
}  // namespace vdvr
