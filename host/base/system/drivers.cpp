#include "vdvr/expert/drivers.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

namespace vdvr {
namespace {

namespace fs = std::filesystem;

std::string first_word(const fs::path& path) {
  std::ifstream file(path);
  std::string word;
  file >> word;
  return word;
}

/// OCL_ICD_VENDORS of the environment, which both loaders know, or where the system keeps them.
std::string vendors_folder() {
  const char* named = std::getenv("OCL_ICD_VENDORS");
  return named != nullptr && *named != '\0' ? named : "/etc/OpenCL/vendors";
}

DriverFile driver_of(const fs::path& file) {
  DriverFile driver{file.string(), first_word(file), {}};
  if (driver.library.empty()) {
    driver.trouble = "it names no library";
    return driver;
  }
  // Not closed: a driver that has started threads must stay, and OpenCL's loader holds it anyhow.
  if (dlopen(driver.library.c_str(), RTLD_LAZY | RTLD_LOCAL) == nullptr) driver.trouble = dlerror();
  return driver;
}

std::vector<DriverFile> drivers_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code none;
  if (folder.extension() == ".icd") files.push_back(folder);
  for (fs::directory_iterator i(folder, none), end; !none && i != end; i.increment(none))
    if (i->path().extension() == ".icd") files.push_back(i->path());
  std::sort(files.begin(), files.end());
  std::vector<DriverFile> drivers;
  for (const auto& file : files) drivers.push_back(driver_of(file));
  return drivers;
}

std::string vendor_name(const std::string& number) {
  if (number == "0x10de") return "NVIDIA";
  if (number == "0x1002") return "AMD";
  if (number == "0x8086") return "Intel";
  return number;
}

/// Of PCI class 3: display controllers. Those of a virtual machine's screen compute nothing.
std::vector<DisplayAdapter> adapters_in(const fs::path& pci) {
  std::vector<DisplayAdapter> found;
  std::error_code none;
  for (fs::directory_iterator i(pci, none), end; !none && i != end; i.increment(none))
    if (first_word(i->path() / "class").rfind("0x03", 0) == 0)
      found.push_back({vendor_name(first_word(i->path() / "vendor")), first_word(i->path() / "device")});
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::pair(a.vendor, a.device) < std::pair(b.vendor, b.device);
  });
  return found;
}

std::string loader_file() {
  Dl_info info{};
  void* symbol = dlsym(RTLD_DEFAULT, "clGetPlatformIDs");
  return symbol != nullptr && dladdr(symbol, &info) != 0 && info.dli_fname != nullptr ? info.dli_fname : "";
}

/// Debian's package with the OpenCL of a vendor's GPUs; empty where there is none that we know.
std::string package_of(const std::string& vendor) {
  if (vendor == "NVIDIA") return "nvidia-opencl-icd (of Debian's non-free)";
  if (vendor == "AMD") return "mesa-opencl-icd, or ROCm's rocm-opencl-icd";
  if (vendor == "Intel") return "intel-opencl-icd";
  return {};
}

}  // namespace

OpenClSetup opencl_setup(const fs::path& pci) {
  const std::string folder = vendors_folder();
  return {loader_file(), folder, drivers_in(folder), adapters_in(pci)};
}

std::vector<std::string> missing_drivers(const OpenClSetup& setup, bool has_cpu, bool has_gpu) {
  std::vector<std::string> lines;
  for (const DriverFile& driver : setup.drivers)
    if (!driver.trouble.empty())
      lines.push_back(
          fmt::format("{} cannot be loaded: {}; install the package that has it again, or remove {}",
                      driver.library.empty() ? "the driver" : driver.library, driver.trouble, driver.file));
  std::vector<std::string> told;
  for (const DisplayAdapter& gpu : setup.gpus) {
    const std::string package = package_of(gpu.vendor);
    if (has_gpu || package.empty() || std::find(told.begin(), told.end(), gpu.vendor) != told.end()) continue;
    told.push_back(gpu.vendor);
    lines.push_back(fmt::format("there is a GPU of {} without OpenCL: install {}", gpu.vendor, package));
  }
  if (!has_cpu && !has_gpu)
    lines.emplace_back("there is no device: for the CPU, apt-get install pocl-opencl-icd");
  return lines;
}

}  // namespace vdvr
