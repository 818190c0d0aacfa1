// Options that every command takes, and how it ends: a summary as text or as JSON.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "apps/common/arguments.hpp"
#include "vdvr/device.hpp"

namespace vdvr::cli {

using Json = nlohmann::ordered_json;

struct CommonOptions {
  std::string device;
  std::uint64_t max_memory = 0;
  std::filesystem::path scratch;  ///< empty: the library's default
  bool json = false, quiet = false, force = false;
};

void add_common(Arguments& args);
CommonOptions common_options(const Arguments& args);
/// Of commands that draw: a device that fails its test (vdvr/expert/trust.hpp) is opened where the user says
/// so.
void add_untrusted(Arguments& args);
void untrusted_option(const Arguments& args);
inline Device open_device(const CommonOptions& common) { return Device(common.device, common.max_memory); }

/// The summary of a command: one JSON object with --json, else what `as_text` prints, nothing with --quiet.
void print_result(const CommonOptions& common, const Json& json, const std::function<void()>& as_text);

}  // namespace vdvr::cli
