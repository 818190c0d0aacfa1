// A large volume for `vdvr bench render`, in minutes where a build takes hours: Shepp-Logan's head as an
// ideal low-pass at the grid's Nyquist frequency leaves it, on a base of (N + 1)^3 samples, with bricks of
// the levels that a linear interpolant of that field needs. It is laid out as a certified volume is, and
// certifies nothing: no scan stands behind it, and faces between levels are not closed. The file says so.
//
//     large_volume N OUT.vdvr [EPSILON]      EPSILON: of the field's range, default 0.03
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <numbers>

#include "host/base/system/parallel.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/expert/simulate.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;

namespace {

constexpr int kGranularity = 4;
constexpr std::uint8_t kHighestLevel = 3;
// Cells beside a surface within which its ringing can need samples: its amplitude falls as 1 / (10 d).
constexpr double kReach = 12;

/// The response of an ideal low-pass to a unit step, d cells behind it: 1/2 + Si(pi d) / pi.
class Edge {
 public:
  Edge() {
    double sum = 0;
    for (int i = 0; i <= kLast; ++i) {
      table_[static_cast<std::size_t>(i)] = static_cast<float>(0.5 + sum);
      sum += (sinc((i + 0.5) / kPerCell)) / kPerCell;  // midpoint rule
    }
  }
  [[nodiscard]] float operator()(double d) const {
    const double at = std::min(std::abs(d) * kPerCell, kLast - 1.0);
    const auto i = static_cast<std::size_t>(at);
    const float f = static_cast<float>(at - static_cast<double>(i));
    const float inside = (1 - f) * table_[i] + f * table_[i + 1];
    return d < 0 ? 1 - inside : inside;
  }

 private:
  static constexpr int kPerCell = 64, kLast = 64 * kPerCell;
  static double sinc(double x) { return std::sin(std::numbers::pi * x) / (std::numbers::pi * x); }
  std::array<float, kLast + 1> table_{};
};

/// An ellipsoid whose surface is `edge`, in cells.
struct Surface {
  double density, cosine, sine;
  Vec3 center, inverse2;  // cells; 1 / semi-axis^2

  /// Cells to the surface, positive inside: to first order, which is exact where it matters, on it.
  [[nodiscard]] double depth(const Vec3& p) const {
    const double dx = p[0] - center[0], dy = p[1] - center[1], z = p[2] - center[2];
    const double x = cosine * dx + sine * dy, y = cosine * dy - sine * dx;
    const double gx = x * inverse2[0], gy = y * inverse2[1], gz = z * inverse2[2];
    const double level2 = x * gx + y * gy + z * gz, slope = std::sqrt(gx * gx + gy * gy + gz * gz);
    return slope > 0 ? (1 - std::sqrt(level2)) * std::sqrt(level2) / slope : 1e9;
  }
};

struct Field {
  Edge edge;
  std::vector<Surface> surfaces;

  explicit Field(std::int64_t cells) {
    const double half = 0.5 * static_cast<double>(cells);
    for (const Ellipsoid& e : shepp_logan(half).ellipsoids) {
      const double phi = e.phi_deg * std::numbers::pi / 180;
      Surface s{e.density, std::cos(phi), std::sin(phi), e.center, {}};
      for (std::size_t a = 0; a < 3; ++a) {
        s.center[a] += half;
        s.inverse2[a] = 1 / (e.semi_axes[a] * e.semi_axes[a]);
      }
      surfaces.push_back(s);
    }
  }
  [[nodiscard]] float at(const Vec3& p) const {
    float sum = 0;
    for (const Surface& s : surfaces) sum += static_cast<float>(s.density) * edge(s.depth(p));
    return sum;
  }
  [[nodiscard]] bool is_smooth(const Vec3& p, double radius) const {
    return std::none_of(surfaces.begin(), surfaces.end(),
                        [&](const Surface& s) { return std::abs(s.depth(p)) < radius + kReach; });
  }
};

/// By axis how far the middle of two samples, a cell apart, lies from their mean at most.
Vec3 largest_bends(const Field& f, const Index3& first) {
  constexpr std::size_t n = 2 * kGranularity + 1;
  std::array<float, n * n * n> s;
  for (std::size_t i = 0; i < s.size(); ++i)
    s[i] = f.at({static_cast<double>(first[0]) + 0.5 * static_cast<double>(i % n),
                 static_cast<double>(first[1]) + 0.5 * static_cast<double>(i / n % n),
                 static_cast<double>(first[2]) + 0.5 * static_cast<double>(i / n / n)});
  constexpr std::array<std::size_t, 3> stride{1, n, n * n};
  Vec3 bends{0, 0, 0};
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t i = 0; i < s.size(); ++i)
      if (i / stride[a] % n % 2 == 1)
        bends[a] = std::max(
            bends[a], std::abs(static_cast<double>(s[i]) - 0.5 * (static_cast<double>(s[i - stride[a]]) +
                                                                  static_cast<double>(s[i + stride[a]]))));
  return bends;
}

/// Levels until the bends of all axes together are within the tolerance; a level quarters those of its axis.
LevelTriple level_of(const Field& f, const Index3& first, double tolerance) {
  Vec3 middle{};
  for (std::size_t a = 0; a < 3; ++a) middle[a] = static_cast<double>(first[a]) + 0.5 * kGranularity;
  LevelTriple level{0, 0, 0};
  if (f.is_smooth(middle, 0.5 * kGranularity * std::numbers::sqrt3)) return level;
  Vec3 bends = largest_bends(f, first);
  while (bends[0] + bends[1] + bends[2] > tolerance) {
    const auto a = static_cast<std::size_t>(std::max_element(bends.begin(), bends.end()) - bends.begin());
    if (level[2 - a] == kHighestLevel) break;
    ++level[2 - a];
    bends[a] /= 4;
  }
  return level;
}

void sample_tile(const Field& f, const MixedVolume& v, const LevelTriple& level, const Index3& first,
                 float* sample) {
  const auto side = v.tile_shape(level);
  const auto at = [&](std::size_t a, std::int64_t i) {
    return std::min(static_cast<double>(first[a]) + std::ldexp(static_cast<double>(i), -level[2 - a]),
                    static_cast<double>(v.grid.cells[a]));
  };
  for (std::int64_t z = 0; z < side[0]; ++z)
    for (std::int64_t y = 0; y < side[1]; ++y)
      for (std::int64_t x = 0; x < side[2]; ++x) *sample++ = f.at({at(0, x), at(1, y), at(2, z)});
}

MixedVolume compose(std::int64_t cells, double epsilon) {
  const Field field(cells);
  MixedVolume v;
  const double half = 0.5 * static_cast<double>(cells);
  v.grid = {{cells, cells, cells}, {-half, -half, -half}, {1, 1, 1}, "pixel"};
  v.granularity = kGranularity;
  v.rate = 1 << kHighestLevel;
  const std::int64_t n = cells + 1;
  v.base.f32.resize(static_cast<std::size_t>(n * n * n));
  parallel_for(n, {}, "base", [&](std::int64_t z) {
    float* to = v.base.f32.data() + z * n * n;
    for (std::int64_t i = 0; i < n * n; ++i)
      *to++ = field.at({static_cast<double>(i % n), static_cast<double>(i / n), static_cast<double>(z)});
  });
  const auto [lo, hi] = std::minmax_element(v.base.f32.begin(), v.base.f32.end());
  const double tolerance = epsilon * (static_cast<double>(*hi) - static_cast<double>(*lo));
  const Bricks bricks(v.grid, kGranularity);
  v.level.resize(static_cast<std::size_t>(bricks.size()));
  v.tile.resize(v.level.size());
  parallel_for(bricks.size(), {}, "levels", [&](std::int64_t b) {
    v.level[static_cast<std::size_t>(b)] = level_of(field, bricks.first_cell(bricks.position(b)), tolerance);
  });
  std::map<LevelTriple, std::uint32_t> count;
  for (std::size_t b = 0; b < v.level.size(); ++b)
    if (v.level[b] != LevelTriple{0, 0, 0}) v.tile[b] = count[v.level[b]]++;
  for (const auto& [level, tiles] : count)
    v.tiles[level].f32.resize(tiles * static_cast<std::size_t>(v.tile_size(level)));
  parallel_for(bricks.size(), {}, "tiles", [&](std::int64_t b) {
    const auto i = static_cast<std::size_t>(b);
    if (v.level[i] == LevelTriple{0, 0, 0}) return;
    sample_tile(
        field, v, v.level[i], bricks.first_cell(bricks.position(b)),
        v.tiles.at(v.level[i]).f32.data() + v.tile[i] * static_cast<std::size_t>(v.tile_size(v.level[i])));
  });
  return v;
}

Certificate record_of() {
  Certificate c;
  c.comparison = true;
  c.input_name = "none";
  c.version = "bench/large_volume";
  c.notes = {"a stand-in for a large certified volume, to time pictures with: certifies nothing"};
  return c;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::int64_t cells = argc > 2 ? std::atoll(argv[1]) : 0;
  const double epsilon = argc > 3 ? std::atof(argv[3]) : 0.03;
  if (cells < kGranularity || cells > 4096 || !(epsilon > 0)) {
    fmt::print(stderr, "usage: large_volume CELLS OUT.vdvr [EPSILON], CELLS from {} to 4096\n", kGranularity);
    return 2;
  }
  const MixedVolume v = compose(cells, epsilon);
  fmt::print("{}^3 base samples, {:.3f} samples per base sample\n", cells + 1,
             storage_of(v, false).samples_ratio);
  write_vdvr(argv[2], v, record_of(), Compression::none);
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "large_volume: {}\n", e.what());
  return 1;
}
