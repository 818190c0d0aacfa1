#include "apps/common/common_options.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "vdvr/expert/scratch.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr::cli {

void add_common(Arguments& args) {
  args.group("Common")
      .value("device", "INDEX|cpu|gpu|NAME",
             "OpenCL device; build, run and render take several, as 0,1 or all (default: a GPU if "
             "there is one)")
      .value("max-memory", "2G",
             "limit of our host and device allocations together (default: half of what is free)")
      .value("scratch", "DIR",
             "where what does not fit that limit is kept meanwhile (default: the output's folder)")
      .flag("json", "one JSON object on standard output, nothing else")
      .flag("quiet", "no progress and no summary")
      .flag("force", "overwrite existing outputs")
      .flag("help,h", "the options that most need, and examples")
      .flag("help-all", "all options, by topic");
}

void add_untrusted(Arguments& args) {
  args.flag("untrusted-device",
            "draw with a device that fails the test of its arithmetic; nothing is certified with one");
}

void untrusted_option(const Arguments& args) { open_untrusted_devices(args.has("untrusted-device")); }

namespace {

// The output's own disk is the one that is known to be large; what has no output takes the library's default.
std::filesystem::path scratch_folder(const Arguments& args) {
  if (args.has("scratch")) return args.path("scratch");
  if (!args.has("output")) return {};
  const std::filesystem::path output = args.path("output");
  return output.has_parent_path() ? output.parent_path() : std::filesystem::path(".");
}

}  // namespace

CommonOptions common_options(const Arguments& args) {
  CommonOptions common;
  common.device = args.text_or("device", "");
  common.max_memory =
      args.has("max-memory") ? parse_bytes("--max-memory", args.text("max-memory")) : half_of_free_memory();
  common.scratch = scratch_folder(args);
  common.json = args.has("json");
  common.quiet = args.has("quiet");
  common.force = args.has("force");
  return common;
}

void print_result(const CommonOptions& common, const Json& json, const std::function<void()>& as_text) {
  if (common.json) {
    fmt::print("{}\n", json.dump(2));
  } else if (!common.quiet) {
    as_text();
  }
}

}  // namespace vdvr::cli
