// How far the bounds lie above the truth: the largest bound over the largest error that a finer gold shows,
// on the bricks where bounds or chance say to look.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/certify/kept/base_of_gold.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/gold/prepared_scan.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/scan/units.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/device.hpp"

namespace vdvr::support {

/// Largest bounds and largest errors over the same nodes and cells, density units.
struct Tightness {
  double gold_bound = 0, gold_error = 0;  ///< T of gold itself: without the shares of P and rounding in it
  double projection_bound = 0;            ///< P: interpolation in u and between kept nodes, a constant
  double projection_error = 0;
  double arithmetic = 0;
  std::int64_t bricks = 0;  ///< looked at in full: those of the largest bounds, and random ones
};

namespace tightness {

constexpr int cells_a_brick = 4;
constexpr std::size_t bricks_by_bound = 12, bricks_by_chance = 24;

// What T may be in every brick that may hold a covered node; negative elsewhere.
inline std::vector<float> brick_bounds(opencl::State& state, GoldStream& stream, const Volume& base,
                                       const Progress& progress) {
  const auto near = stream.bricks_near_coverage();
  const DeviceField field(state, as_mixed(base, cells_a_brick));
  const opencl::DeviceArray<std::uint8_t> selected(state, std::span<const std::uint8_t>(near), "bricks");
  std::vector<float> out(near.size(), -1);
  // Beside interpolation and rounding.
  const auto other = static_cast<float>(stream.projection_in_slack() + stream.rounding_in_slack());
  stream.run(
      near,
      [&](GoldStream::Batch& batch) {
        for (const BrickMeasure& m : batch.measure(field, INFINITY, selected))
          if (m.total >= 0) out[at(m.brick)] = m.slack - other;
      },
      progress, "bounds");
  return out;
}

inline void add_largest(std::vector<std::int64_t>& chosen, const std::vector<float>& bound) {
  std::vector<std::int64_t> order(bound.size());
  std::iota(order.begin(), order.end(), std::int64_t{0});
  const auto wanted = order.begin() + static_cast<std::ptrdiff_t>(std::min(bricks_by_bound, order.size()));
  std::partial_sort(order.begin(), wanted, order.end(),
                    [&](std::int64_t a, std::int64_t b) { return bound[at(a)] > bound[at(b)]; });
  for (auto i = order.begin(); i != wanted; ++i)
    if (bound[at(*i)] >= 0) chosen.push_back(*i);
}

// Gold and slack of one brick, [z][y][x].
struct BrickGold {
  Index3 side{};
  std::vector<float> gold, slack;
  [[nodiscard]] std::size_t index(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return at((z * side[1] + y) * side[0] + x);
  }
};

inline BrickGold brick_gold(GoldStream& stream, std::int64_t brick, std::size_t bricks) {
  std::vector<std::uint8_t> one(bricks, 0);
  one[at(brick)] = 1;
  BrickGold out;
  stream.run(
      one,
      [&](GoldStream::Batch& batch) {
        batch.for_each_node(brick, [&](const Index3& i, float gold, const Slack& slack) {
          for (std::size_t a = 0; a < 3; ++a) out.side[a] = std::max(out.side[a], i[a] + 1);
          out.gold.push_back(gold);
          out.slack.push_back(std::max(slack.above, slack.below));
        });
      },
      {}, "brick");
  return out;
}

// The largest |trilinear interpolation of every finer-th node - fine| over cells whose corners are all
// tested.
inline double interpolation_error(const BrickGold& fine, const BrickGold& coarse, int finer) {
  double worst = 0;
  for (std::int64_t z = 0; z < fine.side[2]; ++z)
    for (std::int64_t y = 0; y < fine.side[1]; ++y)
      for (std::int64_t x = 0; x < fine.side[0]; ++x) {
        const Index3 p{x, y, z};
        Index3 cell{};
        Vec3 f{};
        for (std::size_t a = 0; a < 3; ++a) {
          cell[a] = std::min(p[a] / finer, coarse.side[a] - 2);
          f[a] = static_cast<double>(p[a] - cell[a] * finer) / finer;
        }
        double sum = 0;
        bool tested = true;
        for (std::int64_t c = 0; c < 8; ++c) {
          const std::int64_t dx = c & 1, dy = c >> 1 & 1, dz = c >> 2;
          tested = tested && coarse.slack[coarse.index(cell[0] + dx, cell[1] + dy, cell[2] + dz)] >= 0;
          sum += (dx ? f[0] : 1 - f[0]) * (dy ? f[1] : 1 - f[1]) * (dz ? f[2] : 1 - f[2]) *
                 static_cast<double>(fine.gold[fine.index((cell[0] + dx) * finer, (cell[1] + dy) * finer,
                                                          (cell[2] + dz) * finer)]);
        }
        if (tested)
          worst = std::max(worst, std::abs(sum - static_cast<double>(fine.gold[fine.index(x, y, z)])));
      }
  return worst;
}

// The largest rate of gold there is.
constexpr int finest_gold = 32;

// All but the scan in its units.
inline Tightness measure_in_units(Device& device, const ScanInUnits& from, const Grid& grid,
                                  const FieldOptions& field, const Rates& rates, const Progress& progress) {
  opencl::State& state = device.state();
  PreparedScan prepared(state, from, field, PreparedScan::Sups::of_derivatives, progress);
  const bool cone = from.scan.cone.has_value();
  const auto stream_at = [&](const Rates& r) {
    const GoldSettings settings = gold_settings(grid, cells_a_brick, r);
    return GoldStream(state, prepared.filtered, prepared.sups, settings, prepared.source(settings));
  };
  // Of cone beam there is one way to gold.
  const int upsampling = cone ? rates.upsampling : 16, finer = std::min(4, finest_gold / rates.gold);
  GoldStream sharp = stream_at({upsampling, Interpolation::six_taps, rates.gold}), given = stream_at(rates),
             truth = stream_at({upsampling, Interpolation::six_taps, rates.gold * finer});
  const Coverage coverage(prepared.filtered.geometry, prepared.filtered.views);
  const Volume base =
      cone ? base_of_gold(state, given.source()->kept, coverage, grid, kept_margin(grid, 1), {})
           : reconstruct_field(state, prepared.filtered, prepared.upsampler, grid, 8, Interpolation::cubic,
                               {});
  const std::vector<float> t = brick_bounds(state, sharp, base, progress);

  Tightness out;
  out.arithmetic = given.arithmetic();
  std::vector<std::int64_t> chosen, covered;
  out.projection_bound = given.projection();
  add_largest(chosen, t);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (t[i] < 0) continue;
    covered.push_back(static_cast<std::int64_t>(i));
    out.gold_bound = std::max(out.gold_bound, static_cast<double>(t[i]));
  }
  std::mt19937 random(1);
  std::shuffle(covered.begin(), covered.end(), random);
  covered.resize(std::min(covered.size(), bricks_by_chance));
  chosen.insert(chosen.end(), covered.begin(), covered.end());
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  out.bricks = static_cast<std::int64_t>(chosen.size());

  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::int64_t id = chosen[i];
    const BrickGold fine = brick_gold(truth, id, t.size()), exact = brick_gold(sharp, id, t.size()),
                    computed = brick_gold(given, id, t.size());
    out.gold_error = std::max(out.gold_error, interpolation_error(fine, exact, finer));
    for (std::int64_t z = 0; z < computed.side[2]; ++z)
      for (std::int64_t y = 0; y < computed.side[1]; ++y)
        for (std::int64_t x = 0; x < computed.side[0]; ++x) {
          const std::size_t node = computed.index(x, y, z);
          if (computed.slack[node] < 0) continue;
          out.projection_error =
              std::max(out.projection_error,
                       std::abs(static_cast<double>(computed.gold[node]) -
                                static_cast<double>(fine.gold[fine.index(x * finer, y * finer, z * finer)])));
        }
    report(progress, "truth", static_cast<double>(i + 1) / static_cast<double>(chosen.size()));
  }
  return out;
}

}  // namespace tightness

/// The truth is gold at 4 times the rate from six taps in u at 16x, whose own error is below 1 % of what is
/// measured. Cost: two passes over the grid, then bricks at the finer rate.
inline Tightness measure_tightness(Device& device, const ProjectionSet& scan, const Grid& grid,
                                   const FieldOptions& field, const Rates& rates,
                                   const Progress& progress = {}) {
  const ScanInUnits from(scan);
  Tightness t =
      tightness::measure_in_units(device, from, from_world(grid, from.units), field, rates, progress);
  for (double* value :
       {&t.gold_bound, &t.gold_error, &t.projection_bound, &t.projection_error, &t.arithmetic})
    *value = to_world(*value, from.units);
  return t;
}

}  // namespace vdvr::support
