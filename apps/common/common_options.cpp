#include "apps/common/common_options.hpp"

#include <fmt/format.h>

namespace vdvr::cli {

void add_common(Arguments& args) {
  args.group("Common")
      .value("device", "INDEX|cpu|gpu|NAME", "OpenCL device (default: a GPU if there is one)")
      .value("max-memory", "2G", "limit of our host and device allocations together")
      .flag("json", "one JSON object on standard output, nothing else")
      .flag("quiet", "no progress and no summary")
      .flag("force", "overwrite existing outputs")
      .flag("help,h", "this text");
}

CommonOptions common_options(const Arguments& args) {
  CommonOptions common;
  common.device = args.text_or("device", "");
  if (args.has("max-memory")) common.max_memory = parse_bytes("--max-memory", args.text("max-memory"));
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
