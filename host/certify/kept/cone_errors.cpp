// What kept nodes of cone beam and the filters between them err (docs/error-bounds.md, section 16).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <ranges>
#include <tuple>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/certify/bounds/column_taps.hpp"
#include "host/certify/bounds/dense_rounding.hpp"
#include "host/certify/kept/cone_tiles.hpp"
#include "host/field/fbp/back_project.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;

// What taps make of table entries that err by `entries` and of places that move values by `position`: besides
// these the taps' own rounding, and products along u, two times four, what they add up to, one along v, eight
// lanes, and `more`.
double rounding_by(const ColumnTaps& taps, double entries, double position, double more, double sup) {
  const double square = taps.norm * taps.norm;
  return square * entries + position + 2 * taps.norm * taps.rounding * sup +
         1.01 * unit_roundoff * (5 + 1 + 3 + more) * square * sup;
}

}  // namespace

std::pair<double, double> ConeTiles::roundings_of_sum(std::int64_t views, std::int64_t together) {
  const std::int64_t at_once = std::min<std::int64_t>(together, VDVR_CONE_VIEWS),
                     sums = (together + at_once - 1) / at_once, tables = (views + together - 1) / together;
  return {static_cast<double>(at_once), static_cast<double>(sums + tables)};
}

std::vector<ConeTiles::Form> ConeTiles::forms(Interpolation taps) const {
  if (taps != Interpolation::eight_taps) return {{taps, true}};
  return {{taps, false}, {taps, true}};
}

ConeTiles::Errors ConeTiles::errors(std::int64_t together, Fp64 fp64, const Form& form) {
  const ParallelGeometry& g = scan_.geometry;
  const bool eight = form.taps == Interpolation::eight_taps, upright = upright_views_ && !form.earlier;
  const ColumnTaps& taps = eight ? eight_tap_facts() : six_tap_facts();
  const double rate = eight ? density : 8, finer = rate / density;  // columns and rows to a pixel
  const double views = static_cast<double>(g.views());
  const bool here = fp64 == Fp64::as_here, in_double = here ? in_double_ : fp64 == Fp64::present,
             dense = here ? dense_.has_value() : in_double && g.rows >= fewest_rows;
  // A view's size changes over what taps read.
  const double wedge = upright ? upright_views_->wedge() : 0, spread = 1 / std::pow(1 - 4 * wedge, 2),
               sup = spread * sup_;
  Errors out;
  // I_u I_v - 1 = (I_u - 1) + I_u (I_v - 1).
  const double by_taps = taps.sup * (1 + taps.norm) * sup;
  out.interpolation = by_taps;
  if (upright)
    out.interpolation += taps.norm * taps.norm * by_taps + taps.norm * taps.error_of_wedge(wedge) * sup;
  double entries = 0;
  if (dense) entries = dense_rounding(upsampler_, scan_, columns_, rows_, sup_, sup_, fp64);
  else {
    const double gain = upsampler_.gain_u(), largest = lebesgue_constant(g.rows) * sup_;
    entries = unit_roundoff * (product_error(g.rows, row_run) + 2) * gain * largest +
              column_error(upsampler_, g.columns, columns_, largest, gain * largest, fp64);
  }
  double underflow = 2 * product_underflow(g, upsampler_.gain_u()) + 16 * 0x1p-126;
  const double square = taps.norm * taps.norm;
  if (upright) {
    // In double precision what is stored rounds, and little else; else two roundings of a row's weight
    // besides.
    const double place = upright_views_->place_error(in_double ? 0x1p-53 : unit_roundoff) * pi / rate * sup;
    entries = in_double ? square * spread * entries + place + (1.001 * unit_roundoff + 0x1p-45) * sup
                        : rounding_by(taps, spread * entries, place, 2, sup);
    underflow = square * spread * underflow + 16 * 0x1p-126;
  }
  // Places: numerator, lambda, quotient and sum; relative to what they move the values by, pi / 6 a column.
  // Blocks are this device's: in double precision they do not matter, and those of single are smaller.
  const double unit = in_double ? 0x1p-53 : unit_roundoff;
  // Of a run of heights, places of eight are floats about their middle: a step three and a half times, what
  // they add up to, and the fractions of the middle and of each.
  const double apart = in_double ? unit_roundoff * (7 * finer * row_step_ + 3) : 0.0;
  // Earlier programs had those of leaning detectors, which are not looked at: the least is asked for.
  const double position = form.earlier && upright_views_
                              ? 0.0
                              : (2 * unit * (16 * finer * block_reach_ + 4) + apart) * pi / rate * sup;
  // Four views in a lane; lambda^-2, which a float place makes err more.
  const auto [in_lanes, of_sums] = roundings_of_sum(g.views(), together);
  const double more = in_lanes + (in_double ? 3 : 24);
  out.rounding = rounding_by(taps, entries, position, form.earlier ? more + of_sums : more, sup) +
                 views * largest_weight_ * underflow;
  // Lanes' sums are F's own parts, without what taps cancel.
  if (!form.earlier) out.rounding += 1.01 * unit_roundoff * of_sums * sup;
  return out;
}

// By its weights: the best filter is asked for again by those who keep it.
ConeTiles::Known& ConeTiles::known(std::size_t axis, const GoldFilter& filter) {
  const std::tuple key{axis == 2, filter.rate, filter.weights};
  if (const auto found = filters_.find(key); found != filters_.end()) return found->second;
  Known now{{filter, highest(axis), bands_seen_[axis == 2 ? 1 : 0], most_moments}, {}};
  return filters_.emplace(key, std::move(now)).first->second;
}

double ConeTiles::largest(std::size_t axis, const GoldFilter& filter) {
  Known& of_filter = known(axis, filter);
  std::optional<double>& found = of_filter.largest[axis];
  if (!found) found = largest_of_errors(at_parts_[axis], of_filter.error);
  return *found;
}

// At most what a filter errs along an axis: of some parts, as if no view grew, without views that
// see less than `fewest` radians a node.
double ConeTiles::least_of(std::size_t axis, const ProjectiveError& error, double fewest) const {
  constexpr std::size_t some = 8;
  double largest = 0;
  for (const auto& part : at_parts_[axis] | std::views::take(some)) {
    double sum = 0;
    for (const ViewAtPart& view : part)
      if (view.band >= fewest) sum += view.weight * error.at(view.band, 0);
    largest = std::max(largest, sum);
  }
  return largest;
}

// Designed for the band with which it errs least, most views being below the highest.
ConeTiles::BestFilter ConeTiles::best_filter(int phases, std::size_t axis, int taps, double most) {
  BestFilter best{std::nullopt, HUGE_VAL};
  if (highest(axis) > highest_gold_band) return best;
  if (phases == 1) return {design_gold_filter(1, highest(axis), taps), 0};
  const std::tuple key{axis == 2, phases, taps};
  if (const auto found = best_.find(key); found != best_.end()) return found->second;
  const auto along = [&](const auto& of_axis) {
    return axis == 2 ? of_axis(2) : std::max(of_axis(0), of_axis(1));
  };
  // What they err at least orders them: it takes a twentieth of the whole, which few then need.
  struct Proposal {
    double least = 0;
    std::size_t number = 0;
    GoldFilter filter;
    bool operator<(const Proposal& other) const {
      return std::tie(least, number) < std::tie(other.least, other.number);
    }
  };
  constexpr std::array shares{0.8, 0.85, 0.9, 0.95, 1.0};
  std::vector<Proposal> proposals(shares.size());
  // What is lower errs little.
  const double fewest = 0.7 * highest(axis);
  std::vector<double> bands = bands_seen_[axis == 2 ? 1 : 0];
  std::erase_if(bands, [&](double band) {
    return ProjectiveError::place_of(band, highest(axis)) < ProjectiveError::place_of(fewest, highest(axis));
  });
  parallel_for(std::ssize(shares), {}, "", [&](std::int64_t i) {
    GoldFilter filter = design_gold_filter(phases, shares[at(i)] * highest(axis), taps);
    const ProjectiveError of_parallel(filter, highest(axis), bands, 1);
    const double least = along([&](std::size_t a) { return least_of(a, of_parallel, fewest); });
    proposals[at(i)] = {least, at(i), std::move(filter)};
  });
  std::ranges::sort(proposals, std::less<>{});
  for (Proposal& proposal : proposals) {
    if (proposal.least > std::min(best.error, most)) break;
    const double errs = along([&](std::size_t a) { return largest(a, proposal.filter); });
    if (!(errs < best.error)) continue;
    best = {std::move(proposal.filter), errs};
  }
  if (best.error <= most) best_.emplace(key, best);  // others may err less that were not looked at
  return best;
}

// I_x I_y I_z - 1 = (I_x - 1) + I_x (I_y - 1) + I_x I_y (I_z - 1).
double ConeTiles::filter_error(const GoldFilter& x, const GoldFilter& y, const GoldFilter& z) {
  return largest(0, x) + x.norm * (largest(1, y) + y.norm * largest(2, z));
}

}  // namespace vdvr
