// Measures a stored certificate again: gold, T and P from the projections, V through the shared sampler.
// Shares nothing with build.cpp but the gold stream and that sampler.
#include "vdvr/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "host/gold_stream.hpp"
#include "host/sampler_terms.hpp"
#include "host/worst_node.hpp"
#include "vdvr/error.hpp"
#include "vdvr/reconstruct.hpp"

namespace vdvr {
namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

bool meets(const MixedVolume& v, std::int64_t brick, const std::array<double, 6>& roi) {
  const Index3 n = v.bricks();
  const Index3 p{brick % n[0], brick / n[0] % n[1], brick / n[0] / n[1]};
  for (std::size_t a = 0; a < 3; ++a) {
    const double low = v.grid.origin[a] + static_cast<double>(p[a] * v.granularity) * v.grid.spacing[a];
    const double high =
        v.grid.origin[a] +
        static_cast<double>(std::min(v.grid.cells[a], (p[a] + 1) * v.granularity)) * v.grid.spacing[a];
    if (high < roi[a] || low > roi[a + 3]) return false;
  }
  return true;
}

// Every brick, or for each level the wanted share of its bricks and the one that holds the certificate's
// worst node.
std::vector<std::uint8_t> chosen_bricks(const MixedVolume& v, const Certificate& stored,
                                        const VerifyOptions& options) {
  const std::size_t n = v.level.size();
  std::vector<std::uint8_t> selected(n, options.exhaustive ? 1 : 0);
  if (!options.exhaustive) {
    // A few layers of bricks, so that few slabs have to be filtered; every level in each of them.
    const Index3 counts = v.bricks();
    std::vector<std::int64_t> layers(at(counts[2]));
    std::iota(layers.begin(), layers.end(), std::int64_t{0});
    std::mt19937 random(options.seed);
    std::shuffle(layers.begin(), layers.end(), random);
    layers.resize(std::min<std::size_t>(layers.size(), 5));
    std::map<LevelTriple, std::vector<std::size_t>> strata;
    for (const std::int64_t z : layers)
      for (std::int64_t i = z * counts[0] * counts[1]; i < (z + 1) * counts[0] * counts[1]; ++i)
        strata[v.level[at(i)]].push_back(at(i));
    const double share =
        options.fraction * static_cast<double>(counts[2]) / static_cast<double>(layers.size());
    for (auto& [level, members] : strata) {
      std::shuffle(members.begin(), members.end(), random);
      const auto wanted = std::max<std::size_t>(
          8, static_cast<std::size_t>(std::ceil(share * static_cast<double>(members.size()))));
      for (std::size_t i = 0; i < std::min(wanted, members.size()); ++i) selected[members[i]] = 1;
    }
    const Index3 b = brick_at(v, stored.worst_at);
    selected[at((b[2] * counts[1] + b[1]) * counts[0] + b[0])] = 1;
  }
  if (stored.roi)
    for (std::size_t i = 0; i < n; ++i)
      if (!meets(v, static_cast<std::int64_t>(i), *stored.roi)) selected[i] = 0;
  return selected;
}

}  // namespace

VerifyResult verify(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                    const Certificate& stored, const VerifyOptions& options, const Progress& progress) {
  opencl::State& state = device.state();
  ParallelGeometry used = scan.geometry;
  if (stored.field.center) used.center = *stored.field.center;
  check_scan(used);
  FilteredScan filtered = filter_projections(state, scan, stored.field);
  measure_filter_error(filtered, scan, stored.field);
  Upsampler upsampler(state, filtered);
  const FieldSups sups = field_sups(state, upsampler, filtered);
  GoldStream stream(
      state, filtered, upsampler, sups,
      {volume.grid, volume.granularity, volume.rate, stored.upsampling_u, stored.u_filter, stored.window});

  const SamplerTerms sampler =
      sampler_terms(field_slopes(volume), volume.grid, probe_sampler(device), longest_atlas(device.info()));
  const double others =
      stream.arithmetic() + std::max(sampler.buffer.value, sampler.image3d ? sampler.image3d->value : 0.0);
  VerifyResult result;
  result.epsilon_abs = stored.epsilon_abs;
  result.bricks = static_cast<std::int64_t>(volume.level.size());
  const std::vector<std::uint8_t> selected = chosen_bricks(volume, stored, options);
  const opencl::DeviceArray<std::uint8_t> device_selected(state, std::span<const std::uint8_t>(selected),
                                                          "bricks to verify");
  const DeviceField field(state, volume);
  std::int64_t worst = -1;
  float worst_total = -1;
  const std::int64_t nodes_per_side = std::int64_t{volume.granularity} * volume.rate + 1;
  stream.run(
      selected,
      [&](GoldStream::Batch& batch) {
        for (const BrickMeasure& m :
             batch.measure(field, static_cast<float>(stored.epsilon_abs - others), device_selected)) {
          if (m.total < 0) continue;
          ++result.bricks_tested;
          result.nodes_tested += nodes_per_side * nodes_per_side * nodes_per_side;
          result.measured_max = std::max(result.measured_max, static_cast<double>(m.error));
          if (!(m.total <= worst_total)) {
            worst_total = m.total;
            worst = m.brick;
          }
        }
      },
      progress, "verify");
  if (worst < 0) {
    result.failure = "no tested brick holds a covered gold node";
    return result;
  }
  std::vector<std::uint8_t> one(selected.size(), 0);
  one[at(worst)] = 1;
  stream.run(
      one, [&](GoldStream::Batch& batch) { result.worst_at = worst_node(batch, volume, worst); }, {},
      "worst");
  result.measured_total = static_cast<double>(worst_total);
  result.total = result.measured_total + others;
  result.holds = result.total <= stored.epsilon_abs;
  if (!result.holds) {
    const LevelTriple& l = volume.level[at(worst)];
    result.failure = fmt::format(
        "|V - F| may reach {:.6g} > epsilon {:.6g} at ({:.4f}, {:.4f}, {:.4f}), brick {} of level ({}, {}, "
        "{})",
        result.total, stored.epsilon_abs, result.worst_at[0], result.worst_at[1], result.worst_at[2], worst,
        l[0], l[1], l[2]);
  }
  return result;
}

}  // namespace vdvr
