// What `vdvr devices --probe` says of the machine beside its devices, and whether a device makes a certified
// volume.
#pragma once

#include <string>
#include <vector>

#include "apps/common/common_options.hpp"
#include "vdvr/expert/drivers.hpp"

namespace vdvr::cli {

/// A small scan of a ball, built and verified: {"holds", "seconds", "found"}. Throws only what ends the
/// command.
Json certified_cube(Device& device);
std::string cube_text(const Json& cube);

/// The system, OpenCL's loader and drivers, the display adapters, and what to install.
Json setup_json(const OpenClSetup& setup, const std::vector<std::string>& missing);
void print_setup(const Json& setup);
/// What whoever reports a fault should send.
void print_how_to_report();

}  // namespace vdvr::cli
