// What gold errs that is interpolated from kept nodes (docs/error-bounds.md).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/certify/kept/kept_gold.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;

}  // namespace

const GoldFilter& KeptGold::filter_of(int phases, std::size_t axis) {
  // x and y share theirs.
  const std::pair key{phases, axis == 1 ? std::size_t{0} : axis};
  if (const auto known = filters_.find(key); known != filters_.end()) return known->second;
  const double pitch = key.second == 2 ? scan_.geometry.pitch_v : scan_.geometry.pitch_u;
  const double spacing = key.second == 2 ? spacing_[2] : std::max(spacing_[0], spacing_[1]);
  const int taps = to_int(2 * half_taps_[key.second]);
  return filters_
      .emplace(key, cone_ ? cone_->best_filter(phases, key.second, taps).filter.value()
                          : design_gold_filter(phases, std::min(pi / 2, pi * spacing / pitch), taps))
      .first->second;
}

namespace {

// Second differences of what is not interpolated are those of nodes, each with an error of its own.
double bend(const GoldFilter& f) { return f.rate > 1 ? f.second_difference : 4.0; }
// Three second differences of nodes that each err by themselves, an eighth of them.
constexpr double curved_apart = 1.5;

}  // namespace

KeptGold::ConeParts KeptGold::cone_parts(const GoldFilter& x, const GoldFilter& y, const GoldFilter& z) {
  // What the filters round: a product in runs along z, one more than taps in either filter across z.
  const double sums = 2 * static_cast<double>(half_taps_[0]) + 1;
  const double rounding =
      unit_roundoff * cone_->sup() *
      (z.norm * (product_error(2 * half_taps_[2] + 8, AlongZ::run) + 2) * x.norm * y.norm +
       (x.rate > 1 ? sums : 0.0) * x.norm + (y.rate > 1 ? sums : 0.0) * x.norm * y.norm);
  return {cone_->errors(), cone_->filter_error(x, y, z), rounding};
}

// Every kept node errs by itself.
GoldErrors KeptGold::cone_errors(const GoldLattice& lattice) {
  const GoldFilter &x = filter_of(lattice.phases[0], 0), &y = filter_of(lattice.phases[1], 1),
                   &z = filter_of(lattice.phases[2], 2);
  const double nodes = x.norm * y.norm * z.norm,
               curved =
                   (bend(x) * y.norm * z.norm + x.norm * bend(y) * z.norm + x.norm * y.norm * bend(z)) / 8;
  const ConeParts parts = cone_parts(x, y, z);
  GoldErrors out;
  out.ramp = cone_->largest_weight() * filter_error_bound(upsampler_, scan_);
  out.interpolation = nodes * parts.kept.interpolation + parts.filters;
  out.curved_interpolation = curved * parts.kept.interpolation + curved_apart * parts.filters;
  out.rounding = nodes * parts.kept.rounding + parts.rounding;
  out.curved_rounding = curved * parts.kept.rounding + curved_apart * parts.rounding;
  return out;
}

// Of cone beam a kept node's error passes through the filters, whose interpolant hardly bends from one node
// of gold to the next.
std::array<double, 6> KeptGold::fourth_errors(const GoldLattice& lattice) {
  constexpr double weights = 16;  // magnitudes of a fourth difference's, pure or mixed
  std::array<double, 6> out{};
  if (!cone_) {
    const GoldErrors e = errors(lattice);
    out.fill(weights * (e.interpolation + e.rounding));
    return out;
  }
  const GoldFilter &x = filter_of(lattice.phases[0], 0), &y = filter_of(lattice.phases[1], 1),
                   &z = filter_of(lattice.phases[2], 2);
  const ConeParts parts = cone_parts(x, y, z);
  const double node = parts.kept.interpolation + parts.kept.rounding,
               apart = weights * (parts.filters + parts.rounding);
  const auto pure = [](const GoldFilter& f) { return f.rate > 1 ? f.fourth_difference : weights; };
  out = {pure(x) * y.norm * z.norm,  x.norm * pure(y) * z.norm,  x.norm * y.norm * pure(z),
         bend(x) * bend(y) * z.norm, bend(x) * y.norm * bend(z), x.norm * bend(y) * bend(z)};
  for (double& of_nodes : out) of_nodes = of_nodes * node + apart;
  return out;
}

std::vector<double> KeptGold::interpolation_by(Interpolation taps, const GoldLattice& lattice) {
  const double own = errors(lattice).interpolation;
  if (!cone_) return {own};
  std::vector<double> out;
  for (const ConeTiles::Form& form : cone_->forms(taps))
    out.push_back(own + norm_of_filters(lattice) * (cone_->errors(1, Fp64::as_here, form).interpolation -
                                                    cone_->errors().interpolation));
  return out;
}

std::pair<double, double> KeptGold::rounding_elsewhere(const GoldLattice& lattice, bool this_device,
                                                       Interpolation taps) {
  const double own = errors(lattice).rounding;
  std::pair<double, double> out{own, own};
  const auto take = [&](double other) { out = {std::min(out.first, other), std::max(out.second, other)}; };
  const std::vector<Fp64> devices =
      this_device ? std::vector{Fp64::as_here} : std::vector{Fp64::present, Fp64::absent};
  for (const Fp64 fp64 : devices) {
    if (!cone_) {
      take(parallel_errors(lattice, fp64).rounding);
      continue;
    }
    const double nodes = norm_of_filters(lattice), now = cone_->errors().rounding;
    for (const ConeTiles::Form& form : cone_->forms(taps))
      for (std::int64_t together = 1; together <= std::min(scan_.geometry.views(), ConeTiles::most_views);
           ++together)
        take(own + nodes * (cone_->errors(together, fp64, form).rounding - now));
  }
  return out;
}

double KeptGold::norm_of_filters(const GoldLattice& lattice) {
  return filter_of(lattice.phases[0], 0).norm * filter_of(lattice.phases[1], 1).norm *
         filter_of(lattice.phases[2], 2).norm;
}

GoldErrors KeptGold::errors(const GoldLattice& lattice) {
  return cone_ ? cone_errors(lattice) : parallel_errors(lattice, Fp64::as_here);
}

GoldErrors KeptGold::parallel_errors(const GoldLattice& lattice, Fp64 fp64) {
  const ParallelGeometry& g = scan_.geometry;
  const GoldFilter &x = filter_of(lattice.phases[0], 0), &y = filter_of(lattice.phases[1], 1),
                   &z = filter_of(few_rows() ? 1 : lattice.phases[2], 2);
  const double S = sups_.value;
  // Along z, what the rows hold makes a band-limited function, whose second differences are at most (h pi /
  // pitch)^2 of its largest value (Bernstein).
  const double hz = spacing_[2] * lattice.step[2] / lattice.phases[2];
  const double bend_z = g.rows > 1 ? std::min(4.0, std::pow(pi * hz / g.pitch_v, 2)) : 0.0;
  const double nodes = x.norm * y.norm;
  const double curved = (bend(x) * y.norm + x.norm * bend(y) + nodes * bend_z) / 8;

  const ChainErrors chain =
      chain_errors(upsampler_, scan_, sups_, columns_, blocks_of({}), interpolation_, fp64);
  const double gain_v = cosine_gain(g.rows);
  const double filters = ((1 + x.sup) * (1 + y.sup) * (1 + z.sup) - 1) * S;
  GoldErrors out;
  out.ramp = chain.ramp;
  out.interpolation = nodes * (1 + z.sup) * chain.interpolation + filters;
  out.curved_interpolation = curved * (1 + z.sup) * chain.interpolation + curved_apart * filters;

  // Shared by all rows of a column; of each row by itself, which the product along z multiplies; of each
  // height by itself, product and filter, whose chains round no more than runs; of each node by itself, one
  // more than taps in either filter across z.
  const double shared = chain.position, rows = gain_v * (1 + z.sup) * (chain.columns + chain.summation);
  const double between = !few_rows() ? product_error(2 * half_taps_[2] + 8, AlongZ::run) + 2 : 0.0;
  const double heights = unit_roundoff * S * z.norm *
                         ((g.rows > 1 ? (product_error(g.rows, AlongZ::run) + 2) * gain_v : 0.0) + between);
  const double sums = 2 * static_cast<double>(half_taps_[0]) + 1;
  const double apart = (x.rate > 1 ? sums : 0.0) * unit_roundoff * x.norm * S * (1 + y.sup) +
                       (y.rate > 1 ? sums : 0.0) * unit_roundoff * x.norm * y.norm * S;
  const double curved_heights = (bend(x) * y.norm + x.norm * bend(y) + 4 * nodes) / 8;
  out.rounding = nodes * (shared + rows + heights) + apart + chain.underflow * nodes * gain_v;
  out.curved_rounding = curved * (shared + rows) + curved_heights * heights + curved_apart * apart;
  return out;
}

}  // namespace vdvr
