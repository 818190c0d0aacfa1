// A height costs the reference all coefficients, a point there a row of them; of cone beam each point costs
// it all.
#include "host/verify/verify_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {
namespace {

constexpr double most_work = 5e8;  // multiply-adds for heights, and for points
constexpr std::int64_t least_bricks = 4, most_bricks = 32, least_nodes = 64, least_cone_nodes = 16,
                       most_points = 4096;

}  // namespace

FieldPoints::FieldPoints(const ExactField& exact, const CertifiedRegion& region, const MixedVolume& volume,
                         const std::vector<std::uint8_t>& selected, unsigned seed)
    : flags_(selected.size(), 0) {
  const ParallelGeometry& g = exact.geometry();
  const bool cone = !exact.views().empty();
  const double row = static_cast<double>(g.views() * g.columns),
               point = cone ? row * static_cast<double>(g.rows) : row;
  // Each brick is looked at on two golds or more, of cone beam most on one, at a height of each.
  const auto wanted =
      std::clamp(static_cast<std::int64_t>(most_work / (2 * row * static_cast<double>(g.rows))), least_bricks,
                 most_bricks);
  nodes_each_ = std::max(cone ? least_cone_nodes : least_nodes,
                         std::min(most_points, static_cast<std::int64_t>(most_work / point)) / (2 * wanted));
  const Bricks bricks(volume.grid, volume.granularity);
  for (std::size_t i = 0; i < selected.size(); ++i) {
    Vec3 middle{};
    const Index3 place = bricks.position(static_cast<std::int64_t>(i));
    for (std::size_t a = 0; a < 3; ++a)
      middle[a] = volume.grid.origin[a] +
                  volume.grid.spacing[a] * volume.granularity * (static_cast<double>(place[a]) + 0.5);
    if (selected[i] && region.contains(middle)) bricks_.push_back(i);
  }
  std::mt19937 random(seed);
  std::shuffle(bricks_.begin(), bricks_.end(), random);
  bricks_.resize(std::min(bricks_.size(), at(wanted)));
  // Interpolated gold of cone beam takes nodes around a brick, many more than its own.
  const std::size_t interpolated = cone ? at(least_bricks) : bricks_.size();
  for (std::size_t i = 0; i < bricks_.size(); ++i) flags_[bricks_[i]] = i < interpolated ? 2 : 1;
}

FieldPoints::Outcome FieldPoints::compare(const ExactField& exact, std::span<const VerifyField::Node> nodes,
                                          const Progress& progress) {
  Outcome out;
  std::vector<Vec3> points;
  for (const VerifyField::Node& n : nodes) points.push_back(n.at);
  const std::vector<double> F = exact.at(points, progress);
  out.points = static_cast<std::int64_t>(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double error = std::abs(nodes[i].value - F[i]), limit = nodes[i].arithmetic + exact.rounding();
    const double share = error == 0 ? 0 : error / limit;
    if (share <= out.worst_share) continue;
    out.worst_share = share;
    if (!(error <= limit))
      out.failure = fmt::format(
          "verify computes F as {:.9g} at ({:.6g}, {:.6g}, {:.6g}), where it is {:.9g}: more than the {:.3g} "
          "apart that it may be, so that nothing it finds on this device counts",
          nodes[i].value, points[i][0], points[i][1], points[i][2], F[i], limit);
  }
  return out;
}

}  // namespace vdvr
