// On a sure stretch F is surely above the value, or surely below. Between two that follow each other and lie
// on opposite sides F passes the value at least once, since it is continuous. A stretch between two such
// passages that holds one sure stretch alone is as long as their places allow.
#include "host/measure/measure_line.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/base/system/casts.hpp"
#include "host/picture/rays/ray_walk.hpp"
#include "vdvr/error.hpp"

namespace vdvr::measured {
namespace {

// A piece is halved so often: 2^-20 of it is far below what pictures or tables show.
constexpr int depth = 20;

struct Stretch {
  int side = 0;  ///< 1 above, -1 below, 0 either
  double first = 0, last = 0;
};

/// Stretches of a piece, in order; those that follow each other on one side are one.
class Stretches {
 public:
  explicit Stretches(double value) : value_(value) {}

  void add(const RayPiece& piece) { divide(piece.value, piece.first, piece.last, piece.bound, depth); }
  [[nodiscard]] const std::vector<Stretch>& all() const { return all_; }

 private:
  void divide(const Cubic& b, double first, double last, double e, int left) {
    const double lo = least(b), hi = largest(b);
    if (lo - e > value_) return append({1, first, last});
    if (hi + e < value_) return append({-1, first, last});
    // Nowhere sure: between its coefficients V is too near to the value.
    const bool nowhere = hi - e <= value_ && lo + e >= value_;
    if (left == 0 || nowhere) return append({0, first, last});
    const double middle = 0.5 * (first + last);
    divide(part_of(b, 0, 0.5), first, middle, e, left - 1);
    divide(part_of(b, 0.5, 1), middle, last, e, left - 1);
  }
  void append(const Stretch& s) {
    if (!all_.empty() && all_.back().side == s.side) all_.back().last = s.last;
    else all_.push_back(s);
  }

  double value_;
  std::vector<Stretch> all_;
};

/// Sure stretches alone.
std::vector<Stretch> sure_of(const std::vector<Stretch>& all) {
  std::vector<Stretch> sure;
  for (const Stretch& s : all)
    if (s.side != 0) sure.push_back(s);
  return sure;
}

/// `slack`: what places along the line may err by.
void add_crossings(const std::vector<Stretch>& sure, double slack, LineMeasure& out) {
  // Numbers of the sure stretches behind each crossing.
  std::vector<std::size_t> behind;
  for (std::size_t i = 1; i < sure.size(); ++i) {
    if (sure[i].side == sure[i - 1].side) continue;
    out.crossings.push_back({{sure[i - 1].last - slack, sure[i].first + slack}, sure[i].side > 0});
    behind.push_back(i);
  }
  for (std::size_t c = 0; c + 1 < out.crossings.size(); ++c) {
    LineRun run{sure[behind[c]].side > 0, out.crossings[c].at, out.crossings[c + 1].at, {}};
    if (behind[c + 1] == behind[c] + 1)
      run.width = Interval{std::max(0.0, run.to.lo - run.from.hi), run.to.hi - run.from.lo};
    out.runs.push_back(run);
  }
}

}  // namespace

LineMeasure measure_line(const Field& field, const Vec3& p, const Vec3& q, const LineOptions& options) {
  LineMeasure out;
  WorldRay ray{p, {}};
  double square = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!std::isfinite(p[a]) || !std::isfinite(q[a]))
      throw InputError(
          fmt::format("along: from {} to {} along {}; give finite places", p[a], q[a], "xyz"[a]));
    square += (q[a] - p[a]) * (q[a] - p[a]);
  }
  out.length = std::sqrt(square);
  if (!(out.length > 0) || !std::isfinite(out.length))
    throw InputError("along: both ends are one point; give two");
  if (options.samples < 2 || options.samples > 1 << 24)
    throw InputError(fmt::format("samples: {} along a line; give 2 to 2^24", options.samples));
  for (std::size_t a = 0; a < 3; ++a) ray.direction[a] = (q[a] - p[a]) / out.length;

  const MeasuredRegion& region = field.region();
  const Clip clip{region.low(), region.high(), {0, 0}, region.covered().radius};
  const RayField rays(field.volume(), field.bounds(), clip);
  auto [first, last] = rays.clipped(ray);
  last = std::min(last, out.length);
  if (!(first < last)) throw InputError("along: nothing of the line is certified");
  out.covered = {first, last};

  Stretches stretches(options.value.value_or(0));
  std::int64_t next = 0;
  rays.walk_between(ray, first, last, [&, first = first, last = last](const RayPiece& piece) {
    if (!(piece.last > piece.first)) return true;
    for (; next < options.samples; ++next) {
      const double place = out.length * static_cast<double>(next) / static_cast<double>(options.samples - 1),
                   // The ends of what is certified are rounded inward.
          t = std::abs(place - std::clamp(place, first, last)) <= 1e-9 * out.length
                  ? std::clamp(place, first, last)
                  : place;
      if (t > piece.last) break;
      if (t < piece.first) continue;
      const Cubic at = part_of(piece.value, 0, (t - piece.first) / (piece.last - piece.first));
      out.at.push_back(t);
      out.value.push_back({at[3] - piece.bound, at[3] + piece.bound});
    }
    if (options.value) stretches.add(piece);
    return true;
  });
  if (!options.value) return out;
  for (const Stretch& s : stretches.all())
    if (s.side == 0) out.undecided += s.last - s.first;
  add_crossings(sure_of(stretches.all()), 1e-9 * rays.cell(), out);
  return out;
}

}  // namespace vdvr::measured
