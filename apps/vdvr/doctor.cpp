#include "apps/vdvr/doctor.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "vdvr/certify_scan.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/simulate.hpp"
#include "vdvr/expert/verify.hpp"

namespace vdvr::cli {
namespace {

/// "Debian GNU/Linux 12 (bookworm), Linux 6.1.0 x86_64".
std::string system_name() {
  std::string name;
  std::ifstream release("/etc/os-release");
  for (std::string line; std::getline(release, line);)
    if (line.rfind("PRETTY_NAME=\"", 0) == 0) name = line.substr(13, line.size() - 14) + ", ";
  utsname kernel{};
  if (uname(&kernel) == 0) name += fmt::format("{} {} {}", kernel.sysname, kernel.release, kernel.machine);
  return name;
}

/// Empty where the certificate holds.
std::string trouble_of_cube(Device& device) {
  SimulateOptions setup;
  setup.angles = 24;
  setup.columns = setup.rows = 17;
  const ProjectionSet scan = simulate(sphere(5), setup);
  const AskedTolerance asked{{.relative = 0.05, .absolute = {}}, {}};
  const BuildResult made = certify_scan(device, scan, asked, std::nullopt);
  VerifyOptions every;
  every.exhaustive = true;
  const VerifyResult found = verify(device, scan, made.volume, made.certificate, every);
  return found.holds ? "" : found.failure;
}

}  // namespace

Json certified_cube(Device& device) {
  const auto start = std::chrono::steady_clock::now();
  std::string trouble;
  try {
    trouble = trouble_of_cube(device);
  } catch (const Error& e) {
    trouble = e.what();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return {{"holds", trouble.empty()}, {"seconds", seconds}, {"found", trouble}};
}

std::string cube_text(const Json& cube) {
  const double seconds = cube["seconds"].get<double>();
  if (cube["holds"].get<bool>())
    return fmt::format("built and verified in {:.1f} s: its certificate holds", seconds);
  return "not certified: " + cube["found"].get<std::string>();
}

Json setup_json(const OpenClSetup& setup, const std::vector<std::string>& missing) {
  Json drivers = Json::array(), gpus = Json::array();
  for (const DriverFile& driver : setup.drivers)
    drivers.push_back({{"file", driver.file}, {"library", driver.library}, {"trouble", driver.trouble}});
  for (const DisplayAdapter& gpu : setup.gpus)
    gpus.push_back({{"vendor", gpu.vendor}, {"device", gpu.device}});
  return {{"version", VDVR_VERSION}, {"system", system_name()}, {"loader", setup.loader},
          {"folder", setup.folder},  {"drivers", drivers},      {"display_adapters", gpus},
          {"missing", missing}};
}

void print_setup(const Json& setup) {
  const auto text = [](const Json& value) { return value.get<std::string>(); };
  fmt::print("vdvr {} on {}\n", text(setup["version"]), text(setup["system"]));
  fmt::print("  loader       {}\n", text(setup["loader"]));
  if (setup["drivers"].empty()) fmt::print("  drivers      none in {}\n", text(setup["folder"]));
  for (const Json& driver : setup["drivers"])
    fmt::print("  driver       {}: {}{}\n", text(driver["file"]), text(driver["library"]),
               text(driver["trouble"]).empty() ? "" : ", which cannot be loaded");
  for (const Json& gpu : setup["display_adapters"])
    fmt::print("  display      {} {}\n", text(gpu["vendor"]), text(gpu["device"]));
  for (const Json& line : setup["missing"]) fmt::print("  missing      {}\n", text(line));
}

void print_how_to_report() {
  fmt::print(
      "To report a fault, send this page (vdvr devices --probe), the command as it was typed, all that it\n"
      "printed, and `vdvr info` of the scan.\n");
}

}  // namespace vdvr::cli
