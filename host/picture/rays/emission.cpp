#include "host/picture/rays/emission.hpp"

#include <limits>

namespace vdvr {
namespace {

// Three roundings of an opacity between two points.
constexpr double of_opacity = 0x1p-50;

double extinction(double opacity) {
  if (!(opacity > 0)) return 0;
  return opacity >= 1 ? std::numeric_limits<double>::infinity() : -std::log1p(-opacity);
}

}  // namespace

MediumRanges::MediumRanges(const TransferFunction& transfer) {
  for (const TransferPoint& p : transfer.points) points_.push_back({p.value, p.opacity, p.rgb});
}

// Every linear stretch that the interval meets, cut to it: opacity is monotone on it, and where any of it is
// seen the colours of both its ends are, the ends that are clear included, since just beside them they are
// not.
MediumRange MediumRanges::over(double low, double high) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double least = infinity, most = 0;
  bool opaque = true;
  MediumRange out;
  out.low.fill(infinity);
  out.high.fill(-infinity);
  const auto take = [&](const Point& a, const Point& b) {
    least = std::min({least, a.opacity, b.opacity});
    most = std::max({most, a.opacity, b.opacity});
    if (!(std::max(a.opacity, b.opacity) > 0)) return;
    for (std::size_t c = 0; c < 3; ++c) {
      out.low[c] = std::min({out.low[c], a.rgb[c], b.rgb[c]});
      out.high[c] = std::max({out.high[c], a.rgb[c], b.rgb[c]});
    }
  };
  const auto cut = [](const Point& a, const Point& b, double value) {
    const double f = std::clamp((value - a.value) / (b.value - a.value), 0.0, 1.0);
    Point p{value, (1 - f) * a.opacity + f * b.opacity, {}};
    for (std::size_t c = 0; c < 3; ++c) p.rgb[c] = (1 - f) * a.rgb[c] + f * b.rgb[c];
    return p;
  };
  const auto stretch = [&](const Point& a, const Point& b) {
    opaque &= a.opacity >= 1 && b.opacity >= 1;
    if (!(b.value > a.value)) take(a, b);
    else take(a.value < low ? cut(a, b, low) : a, b.value > high ? cut(a, b, high) : b);
  };
  if (low <= points_.front().value) stretch(points_.front(), points_.front());
  if (high >= points_.back().value) stretch(points_.back(), points_.back());
  for (std::size_t i = 0; i + 1 < points_.size(); ++i)
    if (points_[i + 1].value >= low && points_[i].value <= high) stretch(points_[i], points_[i + 1]);
  // Near opacity 1 extinction makes much of a rounding; only where all is opaque, nothing shines through.
  out.tau_low = opaque ? infinity : extinction(least - of_opacity);
  out.tau_high = most > 0 ? extinction(most + of_opacity) : 0;
  return out;
}

namespace {

double stepped(double behind, double colour, double tau, double length) {
  return colour + (behind - colour) * std::exp(-tau * length);
}

}  // namespace

void box_step(ColourInterval& w, const MediumRange& r, double length) {
  if (!(r.tau_high > 0)) return;
  for (std::size_t c = 0; c < 3; ++c) {
    w.high[c] = stepped(w.high[c], r.high[c], r.high[c] > w.high[c] ? r.tau_high : r.tau_low, length);
    w.low[c] = stepped(w.low[c], r.low[c], r.low[c] < w.low[c] ? r.tau_high : r.tau_low, length);
  }
}

namespace {

int parts_of(const RayPiece& piece, double kappa) {
  const Cubic& b = piece.value;
  const double steepest = 3 * std::max({std::abs(b[1] - b[0]), std::abs(b[2] - b[1]), std::abs(b[3] - b[2])});
  constexpr double most = 64;
  if (!(steepest > 0) || !std::isfinite(piece.bound)) return 1;
  return static_cast<int>(std::clamp(std::ceil(steepest / (2 * kappa * piece.bound)), 1.0, most));
}

}  // namespace

ColourInterval colour_interval(const RayField& field, const WorldRay& ray, const MediumRanges& ranges,
                               const std::array<double, 3>& background, const EmissionOptions& options) {
  std::vector<RayPiece> pieces;
  ColourInterval w{background, background};
  // Bounds of colours that lie anywhere on the ray.
  ColourInterval all = w;
  double depth = 0;
  bool ended = false;
  field.walk(ray, [&](const RayPiece& piece) {
    const MediumRange r = ranges.over(least(piece.value) - piece.bound, largest(piece.value) + piece.bound);
    if (!(r.tau_high > 0)) return true;
    pieces.push_back(piece);
    depth += r.tau_low * (piece.last - piece.first) / field.cell();
    ended = depth > -std::log(options.hidden);
    return !ended;
  });
  if (ended) {
    all = {{0, 0, 0}, {1, 1, 1}};
    w = all;
  }
  std::size_t steps = 0;
  for (auto piece = pieces.rbegin(); piece != pieces.rend(); ++piece) {
    const int parts = parts_of(*piece, options.kappa);
    const double length = (piece->last - piece->first) / field.cell() / parts;
    for (int i = parts - 1; i >= 0; --i) {
      const Cubic b = parts == 1 ? piece->value
                                 : part_of(piece->value, static_cast<double>(i) / parts,
                                           static_cast<double>(i + 1) / parts);
      box_step(w, ranges.over(least(b) - piece->bound, largest(b) + piece->bound), length);
      ++steps;
    }
  }
  // Ten roundings a step.
  const double summed = 0x1p-53 * 16 * static_cast<double>(steps + 1);
  for (std::size_t c = 0; c < 3; ++c) {
    w.low[c] -= summed;
    w.high[c] += summed;
  }
  return w;
}

}  // namespace vdvr
