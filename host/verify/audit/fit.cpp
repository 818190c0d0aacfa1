#include "host/verify/audit/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/system/casts.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t kMostAlong = 33;
constexpr std::size_t kLeastSamples = 100;

}  // namespace

LinearFit linear_fit(const std::vector<double>& w, const std::vector<double>& f) {
  const auto n = static_cast<double>(w.size());
  double mean_w = 0, mean_f = 0, ww = 0, wf = 0, ff = 0;
  for (std::size_t i = 0; i < w.size(); ++i) {
    mean_w += w[i] / n;
    mean_f += f[i] / n;
  }
  for (std::size_t i = 0; i < w.size(); ++i) {
    const double a = w[i] - mean_w, b = f[i] - mean_f;
    ww += a * a;
    wf += a * b;
    ff += b * b;
  }
  LinearFit fit;
  fit.scale = ff > 0 ? wf / ff : 0;
  fit.offset = mean_w - fit.scale * mean_f;
  fit.offset_alone = mean_w - mean_f;
  if (!(ww > 0 && ff > 0)) return fit;
  fit.unexplained = std::max(0.0, 1 - wf * wf / (ww * ff));
  fit.without_scale = (ww - 2 * wf + ff) / ww;
  // What is left of the means is left in every sample.
  const double through_zero = (wf + n * mean_w * mean_f) / (ff + n * mean_f * mean_f);
  const auto left = [&](double scale) {
    const double mean = mean_w - scale * mean_f;
    return (ww - 2 * scale * wf + scale * scale * ff + n * mean * mean) / ww;
  };
  fit.without_offset = left(through_zero);
  fit.without_both = left(1);
  return fit;
}

ThinnedGrid::ThinnedGrid(const Grid& grid, const Coverage& coverage, const AuditOptions& options, double room)
    : thin_(grid), spacing_(grid.spacing) {
  Index3 step{}, first{};
  for (std::size_t a = 0; a < 3; ++a) {
    step[a] = std::max<std::int64_t>(1, (grid.cells[a] + kMostAlong - 2) / (kMostAlong - 1));
    thin_.cells[a] = std::max<std::int64_t>(1, grid.cells[a] / step[a]);
    first[a] = (grid.cells[a] - thin_.cells[a] * step[a]) / 2;
    thin_.spacing[a] = grid.spacing[a] * static_cast<double>(step[a]);
  }
  thin_.origin = grid.position(first);
  const auto counts = [&](const Vec3& p) {
    for (std::size_t a = 0; a < 3; ++a)
      if (options.roi && (p[a] < (*options.roi)[a] || p[a] > (*options.roi)[a + 3])) return false;
    const double around = room * std::max(grid.spacing[0], grid.spacing[1]);
    return coverage.margin(p[0], p[1]) >= around && coverage.margin_z(p[2]) >= room * grid.spacing[2] &&
           (!options.radius || std::hypot(p[0], p[1]) + around <= *options.radius);
  };
  const Index3 n = thin_.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        if (!counts(thin_.position({x, y, z}))) continue;
        samples_.push_back({first[0] + x * step[0], first[1] + y * step[1], first[2] + z * step[2]});
        places_.push_back(at((z * n[1] + y) * n[0] + x));
      }
  if (samples_.size() >= kLeastSamples) return;
  if (room > 0) {
    *this = ThinnedGrid(grid, coverage, options, 0);
    return;
  }
  throw InputError(
      fmt::format("{} of the volume's samples lie where all views see them, too few to register it; give its "
                  "`spacing` and "
                  "`origin`, or audit it as it is",
                  samples_.size()));
}

std::vector<double> ThinnedGrid::field(Device& device, const ProjectionSet& scan, const FieldOptions& options,
                                       const FitSettings& settings) const {
  ReconstructOptions how{options, 8, scan.cone ? Interpolation::linear : Interpolation::cubic};
  how.field.filter = settings.window;
  if (settings.center != 0) how.field.center = stated_center(options, scan.geometry) + settings.center;
  Grid grid = thin_;
  for (std::size_t a = 0; a < 3; ++a) grid.origin[a] -= settings.shift[a] * spacing_[a];
  const Volume f = reconstruct(device, scan, grid, how);
  std::vector<double> values(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) values[i] = static_cast<double>(f.samples[places_[i]]);
  return values;
}

}  // namespace vdvr
