// vdvr bench tune: launch parameters measured on this device, as a row for the table of
// host/base/opencl/column_tuning.cpp.
#include "apps/vdvr/commands/bench_tune.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/options.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/expert/tune.hpp"

namespace vdvr::cli {
namespace {

Json row_of(const TuneCandidate& c) {
  return {{"lanes", c.lanes}, {"tile", c.tile},   {"vectors", c.vectors},
          {"tiles", c.tiles}, {"local", c.local}, {"gups", c.gups}};
}

}  // namespace

int bench_tune(Arguments& args) {
  args.value("size", "256", "samples per axis, and detector columns and rows (default 256)")
      .value("angles", "180", "views (default 180)")
      .value("repetitions", "N", "default 5");
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const std::int64_t size = args.integer_or("size", 256, 16, 2048);
  const std::int64_t views = args.integer_or("angles", 180, 2, 1 << 14);
  const int repetitions = static_cast<int>(args.integer_or("repetitions", 5, 1, 1000));
  Device device = open_device(common);
  ProgressLine progress(args.who(), common.quiet);
  const TuneResult result = tune(device, size, views, repetitions, progress.callback());
  progress.clear();
  Json candidates = Json::array(), filters = Json::array(), recorded;
  for (const TuneCandidate& c : result.candidates) {
    candidates.push_back(row_of(c));
    if (c.recorded) recorded = row_of(c);
  }
  for (const TuneFilter& f : result.filters)
    filters.push_back({{"columns", f.columns},
                       {"product_seconds", f.product_seconds},
                       {"fourier_seconds", f.fourier_seconds}});
  Json best = row_of(result.candidates.front());
  best["device_class"] = device.info().is_gpu ? "gpu" : "cpu";
  best["product_columns"] = result.product_columns;
  const Json line = {{"case", "tune"},
                     {"device", device.info().name},
                     {"driver", device.info().driver},
                     {"size", size},
                     {"angles", views},
                     {"repetitions", repetitions},
                     {"row", best},
                     {"recorded", recorded},
                     {"candidates", candidates},
                     {"filters", filters}};
  fmt::print("{}\n", line.dump());
  return 0;
}

}  // namespace vdvr::cli
