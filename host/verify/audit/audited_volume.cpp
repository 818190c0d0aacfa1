// Which samples count; nearest, linear and cubic interpolation, and how far the others lie from linear.
#include "host/verify/audit/audited_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

/// First and last index of what is marked.
struct Extent {
  std::int64_t first = std::numeric_limits<std::int64_t>::max(), last = -1;
  void add(std::int64_t i) {
    first = std::min(first, i);
    last = std::max(last, i);
  }
  [[nodiscard]] std::int64_t cells() const { return last - first; }
};

/// Weights of four samples, of which the second and third are the ends of the step that `t` is part of.
std::array<double, 4> weights(Between between, double t) {
  if (between == Between::linear) return {0, 1 - t, t, 0};
  if (between == Between::nearest)
    return t < 0.5 ? std::array<double, 4>{0, 1, 0, 0} : std::array<double, 4>{0, 0, 1, 0};
  const double t2 = t * t, t3 = t2 * t;
  return {0.5 * (-t3 + 2 * t2 - t), 0.5 * (3 * t3 - 5 * t2 + 2), 0.5 * (-3 * t3 + 4 * t2 + t),
          0.5 * (t3 - t2)};
}

/// Along one axis: the four samples to Bernstein's coefficients of the cubic, less those of the line, are not
/// formed here but after all axes; each of these is a product over the axes.
using Rows = std::array<std::array<double, 4>, 4>;
constexpr Rows kCubicBernstein{
    {{0, 1, 0, 0}, {-1.0 / 6, 1, 1.0 / 6, 0}, {0, 1.0 / 6, 1, -1.0 / 6}, {0, 0, 1, 0}}};
constexpr Rows kLinearBernstein{
    {{0, 1, 0, 0}, {0, 2.0 / 3, 1.0 / 3, 0}, {0, 1.0 / 3, 2.0 / 3, 0}, {0, 0, 1, 0}}};

using Block = std::array<double, 64>;  // [z][y][x]

Block times(const Rows& rows, const Block& p) {
  Block from = p, to{};
  for (const std::size_t stride : {std::size_t{1}, std::size_t{4}, std::size_t{16}}) {
    for (std::size_t i = 0; i < 64; ++i) {
      const std::size_t k = i / stride % 4, base = i - k * stride;
      to[i] = 0;
      for (std::size_t j = 0; j < 4; ++j) to[i] += rows[k][j] * from[base + j * stride];
    }
    from = to;
  }
  return to;
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

}  // namespace

AuditedVolume::AuditedVolume(const Volume& whole, const Coverage& coverage, const AuditOptions& options)
    : whole_(whole), between_(options.between) {
  const Grid& g = whole.grid;
  const Index3 n = g.samples();
  const auto inside = [&](std::size_t a, double place) {
    return !options.roi || (place >= (*options.roi)[a] && place <= (*options.roi)[a + 3]);
  };
  std::array<Extent, 3> box;
  std::vector<std::uint8_t> all(at(n[0] * n[1]), 0);
  for (std::int64_t y = 0; y < n[1]; ++y)
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const Vec3 p = g.position({x, y, 0});
      if (!inside(0, p[0]) || !inside(1, p[1]) || coverage.margin(p[0], p[1]) < 0) continue;
      if (options.radius && std::hypot(p[0], p[1]) > *options.radius) continue;
      all[at(y * n[0] + x)] = 1;
      box[0].add(x);
      box[1].add(y);
    }
  for (std::int64_t z = 0; z < n[2]; ++z)
    if (const double place = g.position({0, 0, z})[2]; inside(2, place) && coverage.margin_z(place) >= 0)
      box[2].add(z);
  if (box[0].cells() < 1 || box[1].cells() < 1 || box[2].cells() < 1)
    throw InputError(
        fmt::format("no cell of the volume lies where all views see it: its samples reach from ({:.6g}, "
                    "{:.6g}, {:.6g}) to ({:.6g}, "
                    "{:.6g}, {:.6g}), what is seen {:.6g} from the axis and from {:.6g} to {:.6g} along z; "
                    "give its `spacing` and "
                    "`origin`",
                    g.origin[0], g.origin[1], g.origin[2], g.position(g.cells)[0], g.position(g.cells)[1],
                    g.position(g.cells)[2], coverage.inner_radius(), coverage.heights().first,
                    coverage.heights().second));
  Grid part = g;
  for (std::size_t a = 0; a < 3; ++a) {
    first_[a] = box[a].first;
    part.cells[a] = box[a].cells();
  }
  part.origin = g.position(first_);
  const Index3 m = part.samples();
  std::vector<float> samples(at(part.sample_count()));
  for (std::int64_t z = 0; z < m[2]; ++z)
    for (std::int64_t y = 0; y < m[1]; ++y)
      std::copy_n(whole.samples.begin() + (((z + first_[2]) * n[1] + y + first_[1]) * n[0] + first_[0]), m[0],
                  samples.begin() + (z * m[1] + y) * m[0]);
  for (std::int64_t y = 0; y < m[1]; ++y)
    for (std::int64_t x = 0; x < m[0]; ++x)
      columns_.push_back(all[at((y + first_[1]) * n[0] + x + first_[0])]);
  field_ = as_mixed(Volume{part, {}});
  field_.base = std::move(samples);
}

std::vector<std::uint8_t> AuditedVolume::bricks_that_count() const {
  const Bricks bricks(grid(), field_.granularity);
  std::vector<std::uint8_t> counts(field_.level.size(), 0);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const Index3 b = bricks.position(static_cast<std::int64_t>(i));
    const std::int64_t g = field_.granularity;
    for (std::int64_t y = b[1] * g; y < std::min((b[1] + 1) * g, grid().cells[1]) && counts[i] == 0; ++y)
      for (std::int64_t x = b[0] * g; x < std::min((b[0] + 1) * g, grid().cells[0]); ++x)
        if (cell_counts(x, y)) counts[i] = 1;
  }
  return counts;
}

double AuditedVolume::sample(std::int64_t x, std::int64_t y, std::int64_t z) const {
  const Index3 n = whole_.grid.samples();
  const auto in = [&](std::int64_t i, std::size_t a) {
    return std::clamp<std::int64_t>(i + first_[a], 0, n[a] - 1);
  };
  return static_cast<double>(whole_.samples[at((in(z, 2) * n[1] + in(y, 1)) * n[0] + in(x, 0))]);
}

double AuditedVolume::value_at(const Vec3& cells) const {
  Index3 cell{};
  std::array<std::array<double, 4>, 3> w{};
  for (std::size_t a = 0; a < 3; ++a) {
    cell[a] =
        std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(cells[a])), 0, grid().cells[a] - 1);
    w[a] = weights(between_, cells[a] - static_cast<double>(cell[a]));
  }
  double value = 0;
  for (std::int64_t k = 0; k < 4; ++k)
    for (std::int64_t j = 0; j < 4; ++j)
      for (std::int64_t i = 0; i < 4; ++i) {
        const double weight = w[0][at(i)] * w[1][at(j)] * w[2][at(k)];
        if (weight != 0) value += weight * sample(cell[0] + i - 1, cell[1] + j - 1, cell[2] + k - 1);
      }
  return value;
}

// Nearest: W is one sample in each eighth of the cell, where the trilinear function is largest and least at
// the eighth's corners. Cubic: of the tensor product of cubics, less the trilinear function, no value is
// larger than the largest of its Bernstein coefficients.
double AuditedVolume::distance_in_cell(const Index3& c) const {
  Block p{};
  double magnitude = 0;
  for (std::int64_t i = 0; i < 64; ++i) {
    p[at(i)] = sample(c[0] + i % 4 - 1, c[1] + i / 4 % 4 - 1, c[2] + i / 16 - 1);
    magnitude = std::max(magnitude, std::abs(p[at(i)]));
  }
  double most = 0;
  if (between_ == Between::cubic) {
    const Block cubic = times(kCubicBernstein, p), linear = times(kLinearBernstein, p);
    for (std::size_t i = 0; i < 64; ++i) most = std::max(most, std::abs(cubic[i] - linear[i]));
  } else {
    for (std::size_t corner = 0; corner < 8; ++corner)
      for (std::size_t toward = 0; toward < 8; ++toward) {
        // The mean of the corners that differ from this one along some of the axes in `toward`.
        double sum = 0;
        for (std::size_t k = 0; k < 8; ++k) {
          const std::size_t other = corner ^ (k & toward);
          sum += p[(1 + (other >> 2 & 1)) * 16 + (1 + (other >> 1 & 1)) * 4 + 1 + (other & 1)];
        }
        const double own = p[(1 + (corner >> 2 & 1)) * 16 + (1 + (corner >> 1 & 1)) * 4 + 1 + (corner & 1)];
        most = std::max(most, std::abs(own - sum / 8));
      }
  }
  // Some 30 operations on numbers of at most twice the largest sample.
  return most + 128 * std::numeric_limits<double>::epsilon() * magnitude;
}

std::vector<double> AuditedVolume::distance_from_linear(const Progress& progress) const {
  const Bricks bricks(grid(), field_.granularity);
  std::vector<double> distance(field_.level.size(), 0);
  if (between_ == Between::linear) return distance;
  const std::int64_t g = field_.granularity;
  parallel_for(static_cast<std::int64_t>(distance.size()), progress, "between samples", [&](std::int64_t i) {
    const Index3 b = bricks.position(i);
    std::vector<double> of_cells;
    for (std::int64_t z = b[2] * g; z < std::min((b[2] + 1) * g, grid().cells[2]); ++z)
      for (std::int64_t y = b[1] * g; y < std::min((b[1] + 1) * g, grid().cells[1]); ++y)
        for (std::int64_t x = b[0] * g; x < std::min((b[0] + 1) * g, grid().cells[0]); ++x)
          if (cell_counts(x, y)) of_cells.push_back(distance_in_cell({x, y, z}));
    distance[at(i)] = largest(of_cells);
  });
  return distance;
}

}  // namespace vdvr
