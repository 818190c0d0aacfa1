// Finds what a picture shows in blocks of samples, and the orbit that has all of it in the picture.
#include "vdvr/expert/framing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "host/base/system/casts.hpp"
#include "host/scan/geometry/vectors.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t kLeastBlock = 4;
// Blocks along an axis at most: with their extents they take less than a tenth of the samples' memory.
constexpr std::int64_t kMostBlocks = 128;
// Extinction of a block alone that is seen, and of all blocks behind each other that are not: 16 and 25
// levels of 8 bits between black and white. Noise of the air stays below.
constexpr double kSeenAlone = 1.0 / 16, kSeenTogether = 1.0 / 10;
constexpr double kHides = 4;  // extinction: two percent pass
constexpr double kSpeckWeight = 1e-3, kSpeckSide = 1.0 / 16;
constexpr double kMargin = 0.95;
constexpr double kDegree = std::numbers::pi / 180;

/// Extinction by value, so that a sample costs one look-up.
class Extinction {
 public:
  explicit Extinction(const TransferFunction& f)
      : lo_(f.points.front().value), scale_(kEntries / std::max(f.points.back().value - lo_, 1e-300)) {
    for (int i = 0; i <= kEntries; ++i) {
      // The largest within the entry: a shell is not missed.
      double most = 0;
      for (int k = 0; k <= 4; ++k)
        most = std::max(most, transfer_at(f.points, lo_ + (i + k / 4.0) / scale_).opacity);
      table_.push_back(most < 1 ? std::min(kHides, -std::log1p(-most)) : kHides);
    }
  }
  [[nodiscard]] double operator()(float value) const {
    const double x = (static_cast<double>(value) - lo_) * scale_;
    return table_[static_cast<std::size_t>(std::clamp(x, 0.0, static_cast<double>(kEntries)))];
  }

 private:
  static constexpr int kEntries = 4096;
  double lo_, scale_;
  std::vector<double> table_;
};

/// What is seen of the samples of a block.
struct Block {
  double sum = 0;
  std::array<std::int32_t, 3> low{}, high{};  ///< of samples that are seen
  bool is_seen = false;
  int component = 0;  ///< of those that are
};

/// Blocks of samples of a grid, x fastest.
struct Blocks {
  Index3 samples{}, count{};
  std::int64_t side = kLeastBlock;
  std::vector<Block> all;

  explicit Blocks(const Grid& grid) : samples(grid.samples()) {
    const std::int64_t longest = *std::max_element(samples.begin(), samples.end());
    side = std::max(kLeastBlock, (longest + kMostBlocks - 1) / kMostBlocks);
    for (std::size_t a = 0; a < 3; ++a) count[a] = (samples[a] + side - 1) / side;
    all.resize(at(count[0] * count[1] * count[2]));
  }
  [[nodiscard]] std::int64_t index(const Index3& b) const {
    return (b[2] * count[1] + b[1]) * count[0] + b[0];
  }
};

/// `extinction(i, p)` of sample i at p.
template <class Of>
Blocks seen_blocks(const Grid& grid, Of&& extinction) {
  Blocks blocks(grid);
  const Index3 n = blocks.samples;
  Index3 p{};
  std::int64_t i = 0;
  for (p[2] = 0; p[2] < n[2]; ++p[2])
    for (p[1] = 0; p[1] < n[1]; ++p[1])
      for (p[0] = 0; p[0] < n[0]; ++p[0], ++i) {
        const double tau = extinction(i, p);
        if (!(tau > 0)) continue;
        Block& b = blocks.all[at(blocks.index({p[0] / blocks.side, p[1] / blocks.side, p[2] / blocks.side}))];
        for (std::size_t a = 0; a < 3; ++a) {
          const auto x = static_cast<std::int32_t>(p[a]);
          b.low[a] = b.sum > 0 ? std::min(b.low[a], x) : x;
          b.high[a] = b.sum > 0 ? std::max(b.high[a], x) : x;
        }
        b.sum += tau;
      }
  return blocks;
}

Blocks seen_blocks(const Grid& grid, const std::vector<float>& samples, const RenderOptions& o) {
  if (o.mode != RenderMode::iso) {
    const Extinction extinction(o.transfer);
    return seen_blocks(grid, [&](std::int64_t i, const Index3&) { return extinction(samples[at(i)]); });
  }
  const Index3 n = grid.samples(), stride{1, n[0], n[0] * n[1]};
  return seen_blocks(grid, [&](std::int64_t i, const Index3& p) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (p[a] + 1 == n[a]) continue;
      const float x = samples[at(i)], y = samples[at(i + stride[a])];
      for (const IsoSurface& s : o.surfaces) {
        const auto value = static_cast<float>(s.value);
        if ((x >= value) != (y >= value)) return kHides;
      }
    }
    return 0.0;
  });
}

struct Axes {
  Vec3 right, up, forward;
};
/// Whole quarter turns give exact zeros, so that rays run parallel to the axes where the user means them to.
double sine(double deg) { return std::fmod(deg, 180) == 0 ? 0.0 : std::sin(deg * kDegree); }
double cosine(double deg) { return std::fmod(std::abs(deg), 180) == 90 ? 0.0 : std::cos(deg * kDegree); }

/// As in VTK: a positive azimuth moves the camera to its right, a positive elevation towards view-up, here
/// -z.
Axes axes_of(double azimuth_deg, double elevation_deg) {
  const double ca = cosine(azimuth_deg), sa = sine(azimuth_deg), ce = cosine(elevation_deg),
               se = sine(elevation_deg);
  // `up` is the derivative of the direction to the eye by elevation: defined at the poles too.
  return {{ca, -sa, 0}, {-se * sa, -se * ca, -ce}, {-ce * sa, -ce * ca, se}};
}

/// Faint blocks that are seen because many lie behind each other, along one direction of view: in square bins
/// across it, those that have a quarter of what the others have at least. Less, before or behind them, is
/// noise.
void see_together(Blocks& blocks, const Grid& grid, const Axes& axes) {
  const Vec3& h = grid.spacing;
  const double unit = *std::min_element(h.begin(), h.end()), side = static_cast<double>(blocks.side),
               bin = 1.5 * side * *std::max_element(h.begin(), h.end());
  double diagonal2 = 0;
  for (std::size_t a = 0; a < 3; ++a)
    diagonal2 += std::pow(static_cast<double>(blocks.count[a]) * side * h[a], 2);
  const double reach = std::sqrt(diagonal2) / 2 + bin;
  const auto bins = static_cast<std::int64_t>(2 * reach / bin) + 1;
  // Extinction is that of a smallest spacing.
  const double share = h[0] * h[1] * h[2] / (bin * bin * unit);
  struct Bin {
    double sum = 0, squares = 0;
  };
  std::vector<Bin> all(at(bins * bins));
  const auto each = [&](auto&& use) {
    Index3 b{};
    for (b[2] = 0; b[2] < blocks.count[2]; ++b[2])
      for (b[1] = 0; b[1] < blocks.count[1]; ++b[1])
        for (b[0] = 0; b[0] < blocks.count[0]; ++b[0]) {
          Block& block = blocks.all[at(blocks.index(b))];
          if (block.sum == 0 || block.is_seen) continue;
          Vec3 p{};
          for (std::size_t a = 0; a < 3; ++a)
            p[a] = (static_cast<double>(b[a]) + 0.5 - static_cast<double>(blocks.count[a]) / 2) * side * h[a];
          use(block, all[at(static_cast<std::int64_t>((dot(p, axes.up) + reach) / bin) * bins +
                            static_cast<std::int64_t>((dot(p, axes.right) + reach) / bin))]);
        }
  };
  each([&](const Block& block, Bin& b) {
    b.sum += block.sum;
    b.squares += block.sum * block.sum;
  });
  each([&](Block& block, const Bin& b) {
    block.is_seen = share * b.sum >= kSeenTogether && 4 * block.sum * b.sum >= b.squares;
  });
}

void see(Blocks& blocks, const Grid& grid, const std::vector<double>& azimuths_deg, double elevation_deg) {
  // A volume of a cell along an axis fills no more of its blocks.
  double samples = 1;
  for (const std::int64_t n : blocks.samples) samples *= static_cast<double>(std::min(blocks.side, n));
  std::int64_t path = blocks.side;
  for (const std::int64_t n : blocks.samples) path = std::min(path, n);
  for (Block& b : blocks.all) b.is_seen = b.sum * static_cast<double>(path) >= kSeenAlone * samples;
  for (const double azimuth : azimuths_deg) see_together(blocks, grid, axes_of(azimuth, elevation_deg));
}

/// Of a set of blocks that touch.
struct Component {
  double sum = 0;
  std::array<std::int32_t, 3> low{}, high{};  ///< samples
};

/// Gives each seen block the number of its component; those are returned, from number 1 on.
std::vector<Component> join(Blocks& blocks) {
  std::vector<Component> components(1);
  std::vector<Index3> todo;
  const auto take = [&](const Index3& b, int number) {
    Block& block = blocks.all[at(blocks.index(b))];
    if (block.component != 0 || !block.is_seen) return;
    block.component = number;
    Component& c = components[static_cast<std::size_t>(number)];
    for (std::size_t a = 0; a < 3; ++a) {
      c.low[a] = c.sum > 0 ? std::min(c.low[a], block.low[a]) : block.low[a];
      c.high[a] = c.sum > 0 ? std::max(c.high[a], block.high[a]) : block.high[a];
    }
    c.sum += block.sum;
    todo.push_back(b);
  };
  const auto near = [&](std::int64_t b, std::size_t a) {
    return std::pair{std::max<std::int64_t>(0, b - 1), std::min(blocks.count[a] - 1, b + 1)};
  };
  Index3 b{};
  for (b[2] = 0; b[2] < blocks.count[2]; ++b[2])
    for (b[1] = 0; b[1] < blocks.count[1]; ++b[1])
      for (b[0] = 0; b[0] < blocks.count[0]; ++b[0]) {
        components.emplace_back();
        take(b, static_cast<int>(components.size()) - 1);
        if (todo.empty()) components.pop_back();
        while (!todo.empty()) {
          const Index3 from = todo.back();
          todo.pop_back();
          const auto [x0, x1] = near(from[0], 0);
          const auto [y0, y1] = near(from[1], 1);
          const auto [z0, z1] = near(from[2], 2);
          for (std::int64_t z = z0; z <= z1; ++z)
            for (std::int64_t y = y0; y <= y1; ++y)
              for (std::int64_t x = x0; x <= x1; ++x)
                take({x, y, z}, static_cast<int>(components.size()) - 1);
        }
      }
  return components;
}

/// By component: whether it counts.
std::vector<bool> without_specks(const std::vector<Component>& components, const Index3& samples) {
  const double sum = std::accumulate(components.begin(), components.end(), 0.0,
                                     [](double s, const Component& c) { return s + c.sum; });
  std::vector<bool> counts(components.size());
  for (std::size_t i = 1; i < components.size(); ++i) {
    const Component& c = components[i];
    bool is_small = c.sum < kSpeckWeight * sum;
    for (std::size_t a = 0; a < 3; ++a)
      is_small =
          is_small && c.high[a] - c.low[a] < std::max(2.0, kSpeckSide * static_cast<double>(samples[a]));
    counts[i] = !is_small;
  }
  return counts;
}

/// The corners of the cells around the samples low to high.
void add_corners(const Grid& grid, const Block& b, std::vector<Vec3>& points) {
  const Index3 n = grid.samples();
  for (int corner = 0; corner < 8; ++corner) {
    Index3 p{};
    for (std::size_t a = 0; a < 3; ++a)
      p[a] = (corner >> a & 1) != 0 ? std::min<std::int64_t>(n[a] - 1, b.high[a] + 1)
                                    : std::max<std::int64_t>(0, b.low[a] - 1);
    points.push_back(grid.position(p));
  }
}

// --- framing ---

const double kTangent = std::tan(Camera{}.view_angle_deg / 2 * kDegree);

/// Along one axis of the picture: an eye at distance d before a middle m has x at depth z (from the middle,
/// away from the eye) in the picture where |x - m| <= (d + z) t. So d + m / t >= `plus`, d - m / t >=
/// `minus`.
struct Reach {
  double plus = -std::numeric_limits<double>::infinity(), minus = plus;
  void hold(double x, double z, double tangent) {
    plus = std::max(plus, x / tangent - z);
    minus = std::max(minus, -x / tangent - z);
  }
};

void require(const std::vector<Vec3>& points) {
  if (points.empty()) throw InputError("a camera cannot frame nothing: there are no points");
}

double aspect_of(const RenderOptions& o) {
  return static_cast<double>(o.width) / static_cast<double>(o.height);
}

Vec3 middle_of_box(const std::vector<Vec3>& points) {
  Vec3 low = points.front(), high = low;
  for (const Vec3& p : points)
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
}

}  // namespace

std::vector<Vec3> shown_points(const MixedVolume& volume, const RenderOptions& o,
                               const std::vector<double>& azimuths_deg, double elevation_deg) {
  std::vector<Vec3> points;
  if (o.mode != RenderMode::iso && o.transfer.points.empty()) return points;
  const Grid& grid = volume.grid;
  Blocks blocks = seen_blocks(grid, on_grid(volume).samples, o);
  see(blocks, grid, azimuths_deg, elevation_deg);
  const std::vector<Component> components = join(blocks);
  const std::vector<bool> counts = without_specks(components, blocks.samples);
  // Of each row of blocks the box of what is seen.
  Index3 b{};
  for (b[2] = 0; b[2] < blocks.count[2]; ++b[2])
    for (b[1] = 0; b[1] < blocks.count[1]; ++b[1]) {
      Block row;
      bool is_empty = true;
      for (b[0] = 0; b[0] < blocks.count[0]; ++b[0]) {
        const Block& block = blocks.all[at(blocks.index(b))];
        if (!counts[static_cast<std::size_t>(block.component)]) continue;
        for (std::size_t a = 0; a < 3; ++a) {
          row.low[a] = !is_empty ? std::min(row.low[a], block.low[a]) : block.low[a];
          row.high[a] = !is_empty ? std::max(row.high[a], block.high[a]) : block.high[a];
        }
        is_empty = false;
      }
      if (!is_empty) add_corners(grid, row, points);
    }
  return points;
}

OrbitFrame frame_grid(const Grid& grid) {
  OrbitFrame frame;
  double diagonal2 = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double side = static_cast<double>(grid.cells[a]) * grid.spacing[a];
    frame.middle[a] = grid.origin[a] + side / 2;
    diagonal2 += side * side;
  }
  frame.distance = std::sqrt(diagonal2) / 2 / std::sin(Camera{}.view_angle_deg / 2 * kDegree);
  return frame;
}

OrbitFrame frame_view(const std::vector<Vec3>& points, double azimuth_deg, double elevation_deg,
                      double aspect) {
  require(points);
  const Axes axes = axes_of(azimuth_deg, elevation_deg);
  const Vec3 middle = middle_of_box(points);
  const double up = kTangent * kMargin, across = up * aspect;
  Reach x, y;
  for (const Vec3& p : points) {
    const Vec3 q = minus(p, middle);
    const double z = dot(q, axes.forward);
    x.hold(dot(q, axes.right), z, across);
    y.hold(dot(q, axes.up), z, up);
  }
  const double shift_x = (x.plus - x.minus) / 2 * across, shift_y = (y.plus - y.minus) / 2 * up;
  OrbitFrame frame{middle, std::max((x.plus + x.minus) / 2, (y.plus + y.minus) / 2)};
  for (std::size_t a = 0; a < 3; ++a) frame.middle[a] += shift_x * axes.right[a] + shift_y * axes.up[a];
  return frame;
}

OrbitFrame frame_turn(const std::vector<Vec3>& points, double elevation_deg, double aspect) {
  require(points);
  OrbitFrame frame{middle_of_box(points), 0};
  const double up = kTangent * kMargin, across = up * aspect;
  // Between directions 2 degrees apart a point moves by 1 - cos 1 degree, far less than the margin.
  for (int azimuth = 0; azimuth < 360; azimuth += 2) {
    const Axes axes = axes_of(azimuth, elevation_deg);
    for (const Vec3& p : points) {
      const Vec3 q = minus(p, frame.middle);
      const double z = dot(q, axes.forward);
      frame.distance = std::max(
          {frame.distance, std::abs(dot(q, axes.right)) / across - z, std::abs(dot(q, axes.up)) / up - z});
    }
  }
  return frame;
}

Camera orbit_camera(const OrbitFrame& frame, double azimuth_deg, double elevation_deg, double zoom) {
  if (!std::isfinite(azimuth_deg) || !std::isfinite(elevation_deg))
    throw InputError(
        fmt::format("`azimuth` {} and `elevation` {} must be finite", azimuth_deg, elevation_deg));
  if (!(zoom > 0) || !std::isfinite(zoom)) throw InputError(fmt::format("`zoom` {} must be positive", zoom));
  const Axes axes = axes_of(azimuth_deg, elevation_deg);
  Camera camera;
  camera.focal_point = frame.middle;
  for (std::size_t a = 0; a < 3; ++a) camera.position[a] = frame.middle[a] - frame.distance * axes.forward[a];
  camera.view_up = axes.up;
  camera.view_angle_deg = 2 * std::atan(kTangent / zoom) / kDegree;
  check_camera(camera);
  return camera;
}

Camera orbit_camera(const Grid& grid, double azimuth_deg, double elevation_deg, double zoom) {
  return orbit_camera(frame_grid(grid), azimuth_deg, elevation_deg, zoom);
}

OrbitFrame frame_view(const MixedVolume& volume, const RenderOptions& o, double azimuth_deg,
                      double elevation_deg) {
  const std::vector<Vec3> shown = shown_points(volume, o, {azimuth_deg}, elevation_deg);
  return shown.empty() ? frame_grid(volume.grid)
                       : frame_view(shown, azimuth_deg, elevation_deg, aspect_of(o));
}

OrbitFrame frame_turn(const MixedVolume& volume, const RenderOptions& o, double elevation_deg) {
  std::vector<double> azimuths_deg;
  for (int azimuth = 0; azimuth < 360; azimuth += 30) azimuths_deg.push_back(azimuth);
  const std::vector<Vec3> shown = shown_points(volume, o, azimuths_deg, elevation_deg);
  return shown.empty() ? frame_grid(volume.grid) : frame_turn(shown, elevation_deg, aspect_of(o));
}

}  // namespace vdvr
