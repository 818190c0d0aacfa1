// What OpenCL of this machine is made of, beside its devices: where one is missing, this says what was looked
// for and where. Asks no OpenCL implementation.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vdvr/api.hpp"

namespace vdvr {

/// A file by which an implementation makes itself known to the loader (an ICD), and the library it names.
struct DriverFile {
  std::string file, library;
  std::string trouble;  ///< why that library cannot be loaded; empty where it can
};
/// A display adapter, "NVIDIA", "AMD", "Intel" or the number of its vendor.
struct DisplayAdapter {
  std::string vendor, device;  ///< the latter as a number, "0x2330"
};
struct OpenClSetup {
  std::string loader;                ///< the file of libOpenCL that this process has; empty where unknown
  std::string folder;                ///< where driver files were looked for
  std::vector<DriverFile> drivers;   ///< by name
  std::vector<DisplayAdapter> gpus;  ///< that the system lists, with or without a driver
};
/// Loads the library of each driver, as OpenCL's loader does. `pci` is for tests.
VDVR_API OpenClSetup opencl_setup(const std::filesystem::path& pci = "/sys/bus/pci/devices");

/// What to install, a line each, where `setup` lacks a driver for a CPU or for one of its GPUs, by Debian's
/// names of packages. `has_cpu`, `has_gpu`: whether a device of that kind was found.
VDVR_API std::vector<std::string> missing_drivers(const OpenClSetup& setup, bool has_cpu, bool has_gpu);

}  // namespace vdvr
