// Programs of kernels that an earlier process built are taken from the cache folder, and nothing depends on
// it.
#define BOOST_TEST_MODULE cached_programs
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "host/base/opencl/kernel.hpp"
#include "host/base/system/cache_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/device.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;
const opencl::Defines product{{"VDVR_LANES", "4"}, {"VDVR_RUN", "4"}};

// A cache folder of one's own, and whether binaries of this device's programs are kept.
struct OwnCache {
  bool for_this_device = false;
  OwnCache() {
    static const support::TemporaryFolder folder;  // PoCL, which has its cache there too, asks once
    setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
    setenv("VDVR_CACHE", "programs", 1);
    fs::remove_all(cache_folder() / "programs");
    const Device device;
    for_this_device = device.info().platform == "Portable Computing Language" && !behind_a_layer();
    fs::remove_all(cache_folder() / "programs");  // those of the device's test
  }
  [[nodiscard]] std::vector<fs::path> files() const {
    std::vector<fs::path> out;
    const fs::path programs = cache_folder() / "programs";
    if (fs::exists(programs))
      for (const auto& entry : fs::directory_iterator(programs)) out.push_back(entry.path());
    return out;
  }
  [[nodiscard]] std::string file() const {
    std::ifstream in(files().at(0), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& bytes) const { std::ofstream(files().at(0), std::ios::binary) << bytes; }
};

// How many programs come from the cache where one is asked for.
std::size_t ask(const opencl::Defines& defines = product) {
  Device device;
  const std::size_t before = device.state().programs_remembered();
  opencl::program(device.state(), "field/fbp/batched_product", defines);
  return device.state().programs_remembered() - before;
}

BOOST_FIXTURE_TEST_CASE(a_program_is_taken_as_an_earlier_process_built_it, OwnCache) {
  BOOST_TEST(ask() == 0U);
  BOOST_TEST(files().size() == (for_this_device ? 1U : 0U));
  if (!for_this_device) return;
  const std::string first = file();
  BOOST_TEST(ask() == 1U);
  BOOST_TEST(file() == first);
  // Other settings are another program.
  BOOST_TEST(ask({{"VDVR_LANES", "8"}, {"VDVR_RUN", "4"}}) == 0U);
  BOOST_TEST(files().size() == 2U);
}

BOOST_FIXTURE_TEST_CASE(a_file_that_holds_anything_else_changes_nothing, OwnCache) {
  if (!for_this_device) return;
  ask();
  const std::string good = file(), inside = *unsealed(good);
  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 1);
  const std::vector<std::string> bad{"", "x", good.substr(0, good.size() / 2), flipped, good + "x",
                                     sealed("vdvr: a program of kernels\n"),
                                     // Whole, but of another source.
                                     sealed("vdvr: another\n" + inside)};
  for (const std::string& bytes : bad) {
    write(bytes);
    BOOST_TEST(ask() == 0U);
    Device device;
    BOOST_CHECK_NO_THROW(opencl::program(device.state(), "field/fbp/batched_product", product));
    BOOST_CHECK_THROW(opencl::program(device.state(), "no/such/program", {}), BuildError);
  }
  write(flipped);
  BOOST_TEST(ask() == 0U);
  // And what was built is kept again.
  BOOST_TEST(ask() == 1U);
}

BOOST_FIXTURE_TEST_CASE(nothing_is_kept_where_somebody_may_answer_for_the_device, OwnCache) {
  setenv("OPENCL_LAYERS", "some.so", 1);
  BOOST_TEST(ask() == 0U);
  BOOST_TEST(files().empty());
  unsetenv("OPENCL_LAYERS");
  setenv("VDVR_CACHE", "off", 1);
  BOOST_TEST(ask() == 0U);
  BOOST_TEST(ask() == 0U);
  BOOST_TEST(files().empty());
}

// To hand a binary out PoCL compiles the program's kernels again.
BOOST_FIXTURE_TEST_CASE(pocl_is_asked_for_programs_that_many_processes_build, OwnCache) {
  unsetenv("VDVR_CACHE");
  if (!for_this_device) return;
  const auto is_kept = [&] {
    return std::ranges::any_of(files(), [](const fs::path& f) { return !f.has_extension(); });
  };
  for (int process = 0; process < 8; ++process) {
    BOOST_TEST(ask() == 0U);
    BOOST_TEST(!is_kept());
  }
  BOOST_TEST(ask() == 0U);
  BOOST_TEST(is_kept());
  BOOST_TEST(ask() == 1U);
}

BOOST_FIXTURE_TEST_CASE(the_oldest_files_go_first, OwnCache) {
  for (const char* name : {"a", "b", "c"})
    write_cached(std::string("programs/") + name, std::string(100, 'x'));
  const fs::path folder = cache_folder() / "programs";
  const auto now = fs::file_time_type::clock::now();
  fs::last_write_time(folder / "b", now - std::chrono::hours(2));
  fs::last_write_time(folder / "a", now - std::chrono::hours(1));
  forget_oldest("programs", 250);
  BOOST_TEST(!fs::exists(folder / "b"));
  BOOST_TEST((fs::exists(folder / "a") && fs::exists(folder / "c")));
  forget_oldest("programs", 100);
  BOOST_TEST((!fs::exists(folder / "a") && fs::exists(folder / "c")));
  forget_oldest("no/such/folder", 0);
}

}  // namespace
}  // namespace vdvr
