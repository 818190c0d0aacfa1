// Measures candidates of ColumnTuning. Calls back_project.cpp and filter_rows.cpp.
#include "vdvr/expert/tune.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "host/base/opencl/kernel.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fbp/filter_rows.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Values without structure: neither the filter nor the caches may profit from it.
ProjectionSet noise(std::int64_t columns, std::int64_t rows, std::int64_t views) {
  ProjectionSet scan;
  scan.geometry.columns = columns;
  scan.geometry.rows = rows;
  scan.geometry.center = 0.5 * static_cast<double>(columns - 1);
  for (std::int64_t k = 0; k < views; ++k)
    scan.geometry.theta_rad.push_back(std::numbers::pi * static_cast<double>(k) / static_cast<double>(views));
  scan.data.resize(static_cast<std::size_t>(scan.size()));
  std::uint32_t state = 1;
  for (float& p : scan.data) {
    state = state * 1664525u + 1013904223u;
    p = static_cast<float>(state >> 8) * 0x1p-24f;
  }
  return scan;
}

// 64 rows of columns in the middle of the grid, as a reconstruction takes them.
class Trial {
 public:
  Trial(Device& device, std::int64_t size, std::int64_t views)
      : state_(device.state()),
        filtered_(filter_projections(state_, noise(size, size, views), {})),
        upsampler_(state_, filtered_),
        slab_(upsampler_(upsampled_columns(size, 1, 0.25 * static_cast<double>(size)),
                         detector_rows(filtered_.geometry, -0.5 * static_cast<double>(size - 1), 1.0, size))),
        rows_(std::min<std::int64_t>(size, 64)),
        blocks_{size,
                rows_,
                1.0,
                1.0,
                {{-0.5 * static_cast<double>(size - 1), -0.5 * static_cast<double>(rows_ - 1)}},
                {}},
        out_(state_, static_cast<std::uint64_t>(rows_ * size * column_stride(size)), "trial columns") {
    out_.fill(0.0f);
  }

  [[nodiscard]] double updates() const {
    return static_cast<double>(blocks_.nx * rows_ * slab_.rows * slab_.views);
  }
  double seconds(const ColumnTuning& tuning) {
    const auto start = std::chrono::steady_clock::now();
    back_project(state_, filtered_.geometry, slab_, blocks_, Interpolation::linear, out_, tuning);
    opencl::finish(state_, "tune");
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  std::vector<float> samples(const ColumnTuning& tuning) {
    seconds(tuning);
    return out_.to_host();
  }
  // What two orders of the same sum of 2 K fused terms, and positions relative to the block, may differ by.
  [[nodiscard]] double tolerance() const {
    double magnitude = 0;
    for (const double m : filtered_.view_max) magnitude += m;
    return magnitude * (4 * static_cast<double>(slab_.views) * 0x1p-24 +
                        4 * position_error(filtered_.geometry, slab_.columns, blocks_));
  }

 private:
  opencl::State& state_;
  FilteredScan filtered_;
  Upsampler upsampler_;
  UpsampledSlab slab_;
  std::int64_t rows_;
  ColumnBlocks blocks_;
  opencl::DeviceArray<float> out_;
};

std::vector<ColumnTuning> candidates_for(const DeviceInfo& device) {
  std::vector<ColumnTuning> all{column_tuning(device)};
  const auto add = [&](int lanes, int tile, int vectors, int tiles, std::array<std::uint64_t, 3> local) {
    const ColumnTuning& r = all.front();
    if (lanes == r.lanes && tile == r.tile && vectors == r.vectors && tiles == r.tiles && local == r.local)
      return;
    if (local[0] * local[1] * local[2] > device.max_work_group) return;
    all.push_back({r.device_class, lanes, tile, vectors, tiles, local, r.product_columns});
  };
  if (device.is_gpu) {
    for (const int lanes : {1, 4})
      for (const int tile : {1, 8})
        for (const int vectors : {1, 2})
          for (const auto& local :
               {std::array<std::uint64_t, 3>{32, 4, 2}, {16, 4, 4}, {64, 2, 1}, {32, 8, 1}})
            add(lanes, tile, vectors, 1, local);
  } else {
    // Many tiles are a work-group's worth of work by themselves.
    for (const int lanes : {8, 16})
      for (const int tile : {1, 8})
        for (const int vectors : {1, 2}) {
          for (const auto& local : {std::array<std::uint64_t, 3>{1, 8, 16}, {1, 4, 8}, {1, 16, 16}})
            add(lanes, tile, vectors, 1, local);
          for (const int tiles : {2, 4, 8}) add(lanes, tile, vectors, tiles, {1, 1, 1});
        }
  }
  return all;
}

TuneFilter time_filter(Device& device, std::int64_t columns, std::int64_t pixels, int repetitions) {
  const ProjectionSet scan = noise(columns, 64, std::max<std::int64_t>(pixels / (64 * columns), 1));
  const auto seconds = [&](FilterMethod method) {
    std::vector<double> times;
    for (int i = 0; i <= repetitions; ++i) {
      const auto start = std::chrono::steady_clock::now();
      filter_projections(device.state(), scan, {}, {}, method);
      times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    times.erase(times.begin());  // the first compiles
    return median(times);
  };
  return {columns, seconds(FilterMethod::product), seconds(FilterMethod::fourier)};
}

}  // namespace

TuneResult tune(Device& device, std::int64_t size, std::int64_t views, int repetitions,
                const Progress& progress) {
  TuneResult result;
  Trial trial(device, size, views);
  const auto all = candidates_for(device.info());
  const std::vector<float> expected = trial.samples(all.front());
  for (std::size_t c = 0; c < all.size(); ++c) {
    report(progress, "tune", static_cast<double>(c) / static_cast<double>(all.size()));
    const ColumnTuning& t = all[c];
    const std::vector<float> samples = trial.samples(t);
    double worst = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double d = std::abs(static_cast<double>(samples[i]) - static_cast<double>(expected[i]));
      if (!(d <= worst)) worst = d;
    }
    if (!(worst <= trial.tolerance()))
      throw MismatchError(
          fmt::format("tune: lanes {}, tile {}, vectors {}, tiles {} differ by {:.3g}, rounding allows "
                      "{:.3g}: the device's compiler is not to be trusted with them",
                      t.lanes, t.tile, t.vectors, t.tiles, worst, trial.tolerance()));
    std::vector<double> seconds;
    for (int i = 0; i < repetitions; ++i) seconds.push_back(trial.seconds(t));
    result.candidates.push_back(
        {t.lanes, t.tile, t.vectors, t.tiles, t.local, trial.updates() / median(seconds) / 1e9, c == 0});
  }
  std::stable_sort(result.candidates.begin(), result.candidates.end(),
                   [](const TuneCandidate& a, const TuneCandidate& b) { return a.gups > b.gups; });
  for (const std::int64_t columns : {256, 512, 1024, 2048, 4096}) {
    if (!has_transform(device.info(), columns, Precision::fp64)) break;
    result.filters.push_back(time_filter(device, columns, size * size * views / 4, repetitions));
    if (result.filters.back().product_seconds < result.filters.back().fourier_seconds)
      result.product_columns = columns;
  }
  return result;
}

}  // namespace vdvr
