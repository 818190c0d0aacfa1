// What OpenCL a machine has and lacks, from folders as a system has them.
#define BOOST_TEST_MODULE drivers
#include "vdvr/expert/drivers.hpp"

#include <boost/test/unit_test.hpp>

#include <cstdlib>
#include <fstream>

#include "tests/support/temporary_folder.hpp"

using namespace vdvr;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text << "\n";
}

void add_adapter(const fs::path& pci, const std::string& slot, const std::string& type,
                 const std::string& vendor) {
  write(pci / slot / "class", type);
  write(pci / slot / "vendor", vendor);
  write(pci / slot / "device", "0x2330");
}

bool has(const std::vector<std::string>& lines, const std::string& text) {
  for (const auto& line : lines)
    if (line.find(text) != std::string::npos) return true;
  return false;
}

/// A system with one driver that loads, one whose library is gone, a file that names none, and four devices
/// on its bus.
struct System {
  vdvr::support::TemporaryFolder folder;
  OpenClSetup setup;
  System() {
    write(folder / "vendors" / "a.icd", "libm.so.6");
    write(folder / "vendors" / "b.icd", "libnot-there.so.7");
    write(folder / "vendors" / "c.icd", "");
    write(folder / "vendors" / "readme", "libm.so.6");
    add_adapter(folder / "pci", "0000:00:02.0", "0x030000", "0x1234");
    add_adapter(folder / "pci", "0000:41:00.0", "0x030200", "0x10de");
    add_adapter(folder / "pci", "0000:42:00.0", "0x030200", "0x10de");
    add_adapter(folder / "pci", "0000:03:00.0", "0x020000", "0x8086");  // a network's
    setenv("OCL_ICD_VENDORS", (folder / "vendors").c_str(), 1);
    setup = opencl_setup(folder / "pci");
    unsetenv("OCL_ICD_VENDORS");
  }
};

}  // namespace

BOOST_FIXTURE_TEST_CASE(drivers_and_adapters_are_listed, System) {
  BOOST_TEST(setup.folder == (folder / "vendors").string());
  BOOST_REQUIRE(setup.drivers.size() == 3u);
  BOOST_TEST(setup.drivers[0].library == "libm.so.6");
  BOOST_TEST(setup.drivers[0].trouble == "");
  BOOST_TEST(setup.drivers[1].trouble.find("libnot-there.so.7") != std::string::npos);
  BOOST_TEST(setup.drivers[2].trouble != "");
  BOOST_REQUIRE(setup.gpus.size() == 3u);
  BOOST_TEST(setup.gpus[0].vendor == "0x1234");
  BOOST_TEST(setup.gpus[1].vendor == "NVIDIA");
  BOOST_TEST(setup.gpus[1].device == "0x2330");
}

BOOST_FIXTURE_TEST_CASE(what_is_missing_is_told_with_its_package, System) {
  const auto none = missing_drivers(setup, /*has_cpu=*/false, /*has_gpu=*/false);
  BOOST_TEST(none.size() == 4u);  // two drivers, NVIDIA once, a device
  BOOST_TEST(has(none, "libnot-there.so.7"));
  BOOST_TEST(has(none, (folder / "vendors" / "c.icd").string()));
  BOOST_TEST(has(none, "nvidia-opencl-icd"));
  BOOST_TEST(has(none, "pocl-opencl-icd"));
  const auto cpu = missing_drivers(setup, true, false), gpu = missing_drivers(setup, false, true);
  BOOST_TEST((has(cpu, "nvidia-opencl-icd") && !has(cpu, "pocl-opencl-icd")));
  BOOST_TEST((!has(gpu, "nvidia-opencl-icd") && !has(gpu, "pocl-opencl-icd")));
}

BOOST_AUTO_TEST_CASE(a_system_without_folders_has_nothing_and_lacks_a_device) {
  setenv("OCL_ICD_VENDORS", "/nowhere/at/all", 1);
  const OpenClSetup setup = opencl_setup("/nowhere/at/all");
  unsetenv("OCL_ICD_VENDORS");
  BOOST_TEST(setup.drivers.empty());
  BOOST_TEST(setup.gpus.empty());
  BOOST_TEST(missing_drivers(setup, false, false).size() == 1u);
  BOOST_TEST(missing_drivers(setup, true, false).empty());
}
