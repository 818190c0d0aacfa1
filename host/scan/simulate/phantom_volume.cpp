// A sampled volume as an object to be projected: its trilinear interpolation, zero outside the closed box.
//
// A ray has constant z, and the interpolation is linear in the samples: the line integral is the z
// interpolation of the integrals through the slices' bilinear interpolants. Along a ray inside one cell a
// corner's weight, such as (1 - fx)(1 - fy), is quadratic in s; over a segment of length L about its midpoint
// it integrates to L (1 - fx)(1 - fy) + dx dy L^3 / 12, exactly. The weights are the same for every slice, so
// one walk serves all rows. Samples are kept as float sample[y][x][z], z fastest, for that.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <tuple>
#include <utility>

#include "host/scan/simulate/phantom_ray.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr {
namespace {

struct Slices {
  Grid grid;
  std::int64_t nx = 0, ny = 0, nz = 0;  // samples
  std::vector<float> sample;            // [y][x][z]
  [[nodiscard]] const float* column(std::int64_t x, std::int64_t y) const {
    return sample.data() + (y * nx + x) * nz;
  }
};

// The cell of an axis that holds coordinate g (in cells, inside [0, cells]) and the position in it.
std::pair<std::int64_t, double> locate(double g, std::int64_t cells) {
  const std::int64_t cell = std::clamp(static_cast<std::int64_t>(std::floor(g)), std::int64_t{0}, cells - 1);
  return {cell, g - static_cast<double>(cell)};
}

// Gives the crossings of one family of cell planes along a ray, in order.
class Crossings {
 public:
  Crossings(double g0, double dg, double begin) : g0_(g0), dg_(dg), step_(dg > 0 ? 1 : -1) {
    if (std::abs(dg) < 1e-15) {  // along the planes (see clip): crosses none
      next_ = std::numeric_limits<double>::infinity();
      return;
    }
    const double g = g0 + begin * dg;
    plane_ = dg > 0 ? std::floor(g) : std::ceil(g);
    pass(begin);
  }
  [[nodiscard]] double next() const { return next_; }
  // Moves on to the first crossing behind s.
  void pass(double s) {
    while (!(next_ > s)) {
      plane_ += step_;
      next_ = (plane_ - g0_) / dg_;
    }
  }

 private:
  double g0_, dg_, step_, plane_ = 0, next_ = -std::numeric_limits<double>::infinity();
};

struct SliceRange {
  std::int64_t begin, end;
};

// Adds a segment's four corner columns, weighted.
void add_segment(const Slices& s, double gx, double gy, double length, double bend, SliceRange range,
                 double* sums) {
  const auto [x, fx] = locate(gx, s.nx - 1);
  const auto [y, fy] = locate(gy, s.ny - 1);
  const double w00 = length * (1 - fx) * (1 - fy) + bend, w10 = length * fx * (1 - fy) - bend;
  const double w01 = length * (1 - fx) * fy - bend, w11 = length * fx * fy + bend;
  const float *c00 = s.column(x, y), *c10 = s.column(x + 1, y), *c01 = s.column(x, y + 1),
              *c11 = s.column(x + 1, y + 1);
  const auto d = [](float f) { return static_cast<double>(f); };
  for (std::int64_t k = range.begin; k < range.end; ++k)
    sums[k] += w00 * d(c00[k]) + w10 * d(c10[k]) + w01 * d(c01[k]) + w11 * d(c11[k]);
}

// Integrals of one ray through the slices of `range`, into sums[slice].
void trace(const Slices& s, double theta, double u, SliceRange range, std::vector<double>& sums) {
  std::fill(sums.begin(), sums.end(), 0.0);
  // The ray in cells: g = g0 + s dg per axis; s stays a world length.
  const Grid& grid = s.grid;
  const double c = std::cos(theta), sn = std::sin(theta);
  const double gx0 = (u * c - grid.origin[0]) / grid.spacing[0], dx = -sn / grid.spacing[0];
  const double gy0 = (u * sn - grid.origin[1]) / grid.spacing[1], dy = c / grid.spacing[1];
  constexpr double endless = std::numeric_limits<double>::max();
  const RayInterval ray = clip(clip({-endless, endless}, gx0, dx, 0, static_cast<double>(s.nx - 1)), gy0, dy,
                               0, static_cast<double>(s.ny - 1));
  if (ray.empty()) return;
  Crossings in_x(gx0, dx, ray.begin), in_y(gy0, dy, ray.begin);
  for (double at = ray.begin; at < ray.end;) {
    const double to = std::min({in_x.next(), in_y.next(), ray.end});
    const double length = to - at, middle = at + length / 2;
    add_segment(s, gx0 + middle * dx, gy0 + middle * dy, length, dx * dy * length * length * length / 12,
                range, sums.data());
    at = to;
    in_x.pass(at);
    in_y.pass(at);
  }
}

// Where the rows lie between the slices; slice -1: outside the box.
struct RowWeights {
  std::vector<std::int64_t> slice;
  std::vector<double> weight;
  SliceRange range{0, 0};
};

RowWeights row_weights(const Slices& s, std::span<const double> v) {
  RowWeights rows;
  std::int64_t first = s.nz, last = -1;
  for (const double z : v) {
    const double g = (z - s.grid.origin[2]) / s.grid.spacing[2];
    if (!(g >= 0 && g <= static_cast<double>(s.nz - 1))) {
      rows.slice.push_back(-1);
      rows.weight.push_back(0);
      continue;
    }
    const auto [cell, f] = locate(g, s.nz - 1);
    rows.slice.push_back(cell);
    rows.weight.push_back(f);
    first = std::min(first, cell);
    last = std::max(last, cell + 1);
  }
  if (last >= first) rows.range = {first, last + 1};
  return rows;
}

void project(const Slices& s, double theta, std::span<const double> u, std::span<const double> v,
             std::span<double> out) {
  const RowWeights rows = row_weights(s, v);
  std::vector<double> sums(static_cast<std::size_t>(s.nz));
  for (std::size_t i = 0; i < u.size(); ++i) {
    trace(s, theta, u[i], rows.range, sums);
    for (std::size_t j = 0; j < v.size(); ++j) {
      const std::int64_t k = rows.slice[j];
      const double f = rows.weight[j];
      const double* at = sums.data() + (k < 0 ? 0 : k);
      out[j * u.size() + i] = k < 0 ? 0.0 : (1 - f) * at[0] + f * at[1];
    }
  }
}

double trilinear(const Slices& s, const std::array<std::int64_t, 3>& cell, const Vec3& f) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = (corner >> 1) & 1, z = corner >> 2;
    const double w = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
    sum += w * static_cast<double>(s.column(cell[0] + x, cell[1] + y)[cell[2] + z]);
  }
  return sum;
}

double density(const Slices& s, const Vec3& point) {
  const Index3 n{s.nx, s.ny, s.nz};
  std::array<std::int64_t, 3> cell{};
  Vec3 f{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double g = (point[a] - s.grid.origin[a]) / s.grid.spacing[a];
    if (!(g >= 0 && g <= static_cast<double>(n[a] - 1))) return 0;
    std::tie(cell[a], f[a]) = locate(g, n[a] - 1);
  }
  return trilinear(s, cell, f);
}

// In one cell the interpolation is a cubic polynomial along a line: two Gauss points integrate it exactly.
double ray_integral(const Slices& s, const Vec3& point, const Vec3& direction) {
  const Grid& grid = s.grid;
  const Index3 n{s.nx, s.ny, s.nz};
  Vec3 g{}, d{};
  // From the point nearest to the box's middle, so that a far source costs no digits.
  double to_middle = 0;
  for (std::size_t a = 0; a < 3; ++a)
    to_middle += (grid.origin[a] + 0.5 * static_cast<double>(grid.cells[a]) * grid.spacing[a] - point[a]) *
                 direction[a];
  constexpr double endless = std::numeric_limits<double>::max();
  RayInterval ray{-endless, endless};
  for (std::size_t a = 0; a < 3; ++a) {
    g[a] = (point[a] + to_middle * direction[a] - grid.origin[a]) / grid.spacing[a];
    d[a] = direction[a] / grid.spacing[a];
    ray = clip(ray, g[a], d[a], 0, static_cast<double>(n[a] - 1));
  }
  if (ray.empty()) return 0;
  std::array<Crossings, 3> in{Crossings(g[0], d[0], ray.begin), Crossings(g[1], d[1], ray.begin),
                              Crossings(g[2], d[2], ray.begin)};
  const auto value = [&](double at) {
    std::array<std::int64_t, 3> cell{};
    Vec3 f{};
    for (std::size_t a = 0; a < 3; ++a) std::tie(cell[a], f[a]) = locate(g[a] + at * d[a], n[a] - 1);
    return trilinear(s, cell, f);
  };
  constexpr double gauss = 0.57735026918962576;  // 1 / sqrt(3)
  double sum = 0;
  for (double at = ray.begin; at < ray.end;) {
    const double to = std::min({in[0].next(), in[1].next(), in[2].next(), ray.end}), half = 0.5 * (to - at),
                 middle = at + half;
    sum += half * (value(middle - gauss * half) + value(middle + gauss * half));
    at = to;
    for (Crossings& crossings : in) crossings.pass(at);
  }
  return sum;
}

void check(const Volume& volume) {
  const Index3 n = volume.grid.samples();
  for (std::size_t a = 0; a < 3; ++a) {
    if (n[a] < 2)
      throw InputError(
          fmt::format("volume of {} x {} x {} samples: at least 2 along each axis are needed to interpolate",
                      n[0], n[1], n[2]));
    if (!(volume.grid.spacing[a] > 0) || !std::isfinite(volume.grid.spacing[a]) ||
        !std::isfinite(volume.grid.origin[a]))
      throw InputError(fmt::format("volume: spacing {} or origin {} on axis {} is not usable",
                                   volume.grid.spacing[a], volume.grid.origin[a], a));
  }
  if (static_cast<std::uint64_t>(volume.grid.sample_count()) != volume.samples.size())
    throw InputError(fmt::format("volume: {} samples for a grid of {} x {} x {}", volume.samples.size(), n[0],
                                 n[1], n[2]));
  const auto bad = std::find_if_not(volume.samples.begin(), volume.samples.end(),
                                    [](float f) { return std::isfinite(f); });
  if (bad != volume.samples.end())
    throw InputError(
        fmt::format("volume: sample {} is {}; replace samples that are not finite before projecting",
                    bad - volume.samples.begin(), *bad));
}

std::shared_ptr<const Slices> reorder(const Volume& volume) {
  auto s = std::make_shared<Slices>();
  s->grid = volume.grid;
  const Index3 n = volume.grid.samples();
  s->nx = n[0];
  s->ny = n[1];
  s->nz = n[2];
  s->sample.resize(volume.samples.size());
  for (std::int64_t y = 0; y < s->ny; ++y)
    for (std::int64_t z = 0; z < s->nz; ++z)
      for (std::int64_t x = 0; x < s->nx; ++x)
        s->sample[static_cast<std::size_t>((y * s->nx + x) * s->nz + z)] =
            volume.samples[static_cast<std::size_t>((z * s->ny + y) * s->nx + x)];
  return s;
}

std::string describe(const Volume& v) {
  Sha256 hash;
  hash.update(v.samples.data(), v.samples.size() * sizeof(float));
  return fmt::format("{{\"volume\":{{\"cells\":[{}],\"origin\":[{}],\"spacing\":[{}],\"sha256\":\"{}\"}}}}",
                     fmt::join(v.grid.cells, ","), fmt::join(v.grid.origin, ","),
                     fmt::join(v.grid.spacing, ","), hash.hex());
}

}  // namespace

Phantom volume_phantom(Volume volume) {
  check(volume);
  Phantom p;
  p.name = "volume";
  p.description = describe(volume);
  std::shared_ptr<const Slices> slices;
  try {
    slices = reorder(volume);
  } catch (const std::bad_alloc&) {
    throw ResourceError(
        fmt::format("no memory for a second copy of the volume ({:.1f} MiB); use a smaller volume",
                    static_cast<double>(volume.samples.size() * sizeof(float)) / (1 << 20)));
  }
  p.density = [slices](const Vec3& point) { return density(*slices, point); };
  p.line_integral = [slices](double theta, double u, double v) {
    double value = 0;
    project(*slices, theta, std::span(&u, 1), std::span(&v, 1), std::span(&value, 1));
    return value;
  };
  p.view_integrals = [slices](double theta, std::span<const double> u, std::span<const double> v,
                              std::span<double> out) { project(*slices, theta, u, v, out); };
  p.ray_integral = [slices](const Vec3& point, const Vec3& direction) {
    return ray_integral(*slices, point, direction);
  };
  return p;
}

}  // namespace vdvr
