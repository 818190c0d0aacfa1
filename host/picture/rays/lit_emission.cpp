#include "host/picture/rays/lit_emission.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace vdvr {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The cubic of a piece on a part [from, to] of the ray that lies in it.
Cubic between(const RayPiece& piece, double from, double to) {
  const double length = piece.last - piece.first;
  const auto at = [&](double t) { return std::clamp((t - piece.first) / length, 0.0, 1.0); };
  return part_of(piece.value, at(from), at(to));
}

Cubic difference(const Cubic& a, const Cubic& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]};
}

/// The largest slope of a cubic, per piece.
double steepest(const Cubic& b) {
  return 3 * std::max({std::abs(b[1] - b[0]), std::abs(b[2] - b[1]), std::abs(b[3] - b[2])});
}

/// Into how many parts a cubic is cut so that the coefficients of each spread by 2 kappa times the bound.
double parts_of(const Cubic& b, double bound, double kappa) {
  constexpr double most = 64;
  if (!(steepest(b) > 0) || !std::isfinite(bound)) return 1;
  return std::clamp(std::ceil(steepest(b) / (2 * kappa * bound)), 1.0, most);
}

}  // namespace

// What one cell of each of the seven rays has in common.
struct LitEmission::Step {
  double length = 0;  // base cells
  Cubic value{};
  double bound = 0;
  std::array<Cubic, 3> change{};         // of V over one base cell along each axis
  std::array<double, 3> change_bound{};  // of F's change beside it
  Vec3 view{};
};

LitEmission::LitEmission(const RayField& drawn, const RayField& known, const Grid& grid,
                         const RenderOptions& o, double gradient_full, const EmissionOptions& emission)
    : drawn_(drawn), known_(known), ranges_(o.transfer), lights_(o, gradient_full), emission_(emission) {
  const double unit = std::min({grid.spacing[0], grid.spacing[1], grid.spacing[2]});
  for (std::size_t a = 0; a < 3; ++a) {
    half_[a] = 0.5 * grid.spacing[a];
    per_length_[a] = unit / grid.spacing[a];
  }
  colour_low_ = infinity;
  colour_high_ = -infinity;
  for (const TransferPoint& p : o.transfer.points)
    for (const double c : p.rgb) {
      const auto [low, high] = lit_colours(c, c, lights_.any());
      colour_low_ = std::min(colour_low_, low);
      colour_high_ = std::max(colour_high_, high);
    }
}

// Where a neighbour leaves the region in which bounds hold, F may be anything there.
std::array<LitEmission::Pieces, 6> LitEmission::neighbours(const WorldRay& ray, double first,
                                                           double last) const {
  std::array<Pieces, 6> all;
  for (std::size_t i = 0; i < 6; ++i) {
    Pieces& pieces = all[i];
    WorldRay beside = ray;
    beside.origin[i / 2] += (i % 2 == 0 ? -1 : 1) * half_[i / 2];
    auto [from, to] = known_.clipped(beside);
    from = std::clamp(from, first, last);
    to = std::clamp(to, from, last);
    if (from > first) pieces.push_back({first, from, {}, 0, infinity});
    known_.walk_between(beside, from, to, [&](const RayPiece& piece) {
      pieces.push_back(piece);
      return true;
    });
    const double end = pieces.empty() ? first : pieces.back().last;
    if (last > end) pieces.push_back({end, last, {}, 0, infinity});
  }
  return all;
}

void LitEmission::pass(const Step& step, LitRay& seen) const {
  const MediumRange whole = ranges_.over(least(step.value) - step.bound, largest(step.value) + step.bound);
  if (!(whole.tau_high > 0)) return;
  double wanted = parts_of(step.value, step.bound, emission_.kappa);
  for (std::size_t a = 0; a < 3; ++a) {
    wanted = std::max(wanted, parts_of(step.change[a], step.change_bound[a], emission_.kappa));
    seen.untested |= !std::isfinite(step.change_bound[a]);
  }
  const int parts = static_cast<int>(wanted);
  const double length = step.length / parts;
  for (int i = parts - 1; i >= 0; --i) {
    const double from = static_cast<double>(i) / parts, to = static_cast<double>(i + 1) / parts;
    const Cubic b = part_of(step.value, from, to);
    const MediumRange r = ranges_.over(least(b) - step.bound, largest(b) + step.bound);
    ++seen.parts;
    if (!(r.tau_high > 0)) continue;
    GradientBox box;
    for (std::size_t a = 0; a < 3; ++a) {
      const Cubic d = part_of(step.change[a], from, to);
      box.low[a] = (least(d) - step.change_bound[a]) * per_length_[a];
      box.high[a] = (largest(d) + step.change_bound[a]) * per_length_[a];
    }
    const LightRange light = lights_.over(box, step.view);
    MediumRange lit = r;
    for (std::size_t c = 0; c < 3; ++c)
      std::tie(lit.low[c], lit.high[c]) = lit_colours(r.low[c], r.high[c], light);
    box_step(seen.colours, lit, length);
  }
}

// Steps end where a piece of any of the seven rays does. Faces that lie at one place up to rounding are taken
// for one: what a piece says is then used that far beside it, and its bound allows for what it moves there.
void LitEmission::take_steps(const WorldRay& ray, const Pieces& pieces, LitRay& seen) const {
  const double one_place = 0x1p-46 * (pieces.back().last + drawn_.cell());
  const auto bound_of = [&](const RayPiece& p) {
    return p.bound + steepest(p.value) / (p.last - p.first) * one_place;
  };
  const auto around = neighbours(ray, pieces.front().first, pieces.back().last);
  std::array<std::size_t, 6> at{};
  for (std::size_t i = 0; i < 6; ++i) at[i] = around[i].size() - 1;
  for (auto piece = pieces.rbegin(); piece != pieces.rend(); ++piece) {
    double end = piece->last;
    while (end > piece->first) {
      double begin = piece->first;
      for (std::size_t i = 0; i < 6; ++i) {
        while (at[i] > 0 && around[i][at[i]].first >= end - one_place) --at[i];
        const double first = around[i][at[i]].first;
        if (first > piece->first + one_place) begin = std::max(begin, std::min(first, end));
      }
      Step step;
      step.length = (end - begin) / drawn_.cell();
      step.value = between(*piece, begin, end);
      step.bound = piece->bound;
      step.view = ray.direction;
      for (std::size_t a = 0; a < 3; ++a) {
        const RayPiece &low = around[2 * a][at[2 * a]], &high = around[2 * a + 1][at[2 * a + 1]];
        step.change[a] = difference(between(high, begin, end), between(low, begin, end));
        step.change_bound[a] = bound_of(low) + bound_of(high);
      }
      pass(step, seen);
      end = begin;
    }
  }
}

LitRay LitEmission::along(const WorldRay& ray, const std::array<double, 3>& background) const {
  LitRay seen;
  seen.colours = {background, background};
  Pieces pieces;
  double depth = 0;
  bool ended = false;
  drawn_.walk(ray, [&](const RayPiece& piece) {
    const MediumRange r = ranges_.over(least(piece.value) - piece.bound, largest(piece.value) + piece.bound);
    if (!(r.tau_high > 0)) return true;
    pieces.push_back(piece);
    seen.untested |= !std::isfinite(piece.bound);
    depth += r.tau_low * (piece.last - piece.first) / drawn_.cell();
    ended = depth > -std::log(emission_.hidden);
    return !ended;
  });
  if (pieces.empty()) return seen;
  const double most = std::max({1.0, std::abs(colour_low_), std::abs(colour_high_)});
  if (ended)
    for (std::size_t c = 0; c < 3; ++c) {
      seen.colours.low[c] = std::min(background[c], colour_low_);
      seen.colours.high[c] = std::max(background[c], colour_high_);
    }
  take_steps(ray, pieces, seen);
  // Of a part: the step 16 roundings, its colours under light below 240. The 24th power takes its cosine's
  // error 24 times.
  const double rounding = 0x1p-53 * 256 * most * static_cast<double>(seen.parts + 1);
  for (std::size_t c = 0; c < 3; ++c) {
    seen.colours.low[c] -= rounding;
    seen.colours.high[c] += rounding;
  }
  return seen;
}

}  // namespace vdvr
