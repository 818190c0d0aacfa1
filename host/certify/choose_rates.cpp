// The rates whose bounds leave room for the grid, by trial on sample blocks of the gold stream.
#include "host/certify/choose_rates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "host/base/system/casts.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Of the tolerance, what T, P and rounding may take: a smaller share costs time, a larger one storage.
constexpr double share = 0.5, patient_share = 0.65;
// The same for P alone: a finer cubic interpolation costs memory only.
constexpr double linear_share = 0.1, cubic_share = 0.03;

// Of the bricks that are looked at and as high, the one nearest to a place; the place where there is none.
Index3 nearest(const Bricks& bricks, const Index3& place, const std::vector<std::uint8_t>& looked_at) {
  const Index3 n = bricks.along();
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  Index3 out = place;
  for (std::int64_t y = 0; y < n[1]; ++y)
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const std::int64_t dx = x - place[0], dy = y - place[1], distance = dx * dx + dy * dy;
      if (distance >= least || !looked_at[at(bricks.number({x, y, place[2]}))]) continue;
      least = distance;
      out = {x, y, place[2]};
    }
  return out;
}

// A few large blocks at different radii, on at most two slabs: what a brick of each holds for the rest. Those
// around bricks that are looked at anyway, where these are not all.
std::vector<std::uint8_t> trial_bricks(const Grid& grid, int granularity, int gold,
                                       const std::vector<std::uint8_t>& looked_at) {
  const Bricks bricks(grid, granularity);
  const Index3 n = bricks.along();
  std::vector<std::uint8_t> selected(at(bricks.size()), 0);
  const std::int64_t side = std::max<std::int64_t>(
      1, std::min<std::int64_t>(128, 1024 / gold) / (std::int64_t{granularity} * gold));
  for (const auto& [fx, fy, fz] :
       {std::array{0.5, 0.5, 0.5}, std::array{0.25, 0.5, 0.5}, std::array{0.5, 0.2, 0.5},
        std::array{0.72, 0.7, 0.5}, std::array{0.35, 0.35, 0.5}}) {
    const std::array<double, 3> f{fx, fy, fz};
    Index3 first{}, middle{};
    for (std::size_t a = 0; a < 3; ++a)
      middle[a] = static_cast<std::int64_t>(f[a] * static_cast<double>(n[a]));
    middle = nearest(bricks, middle, looked_at);
    for (std::size_t a = 0; a < 3; ++a)
      first[a] = std::clamp<std::int64_t>(middle[a] - side / 2, 0, std::max<std::int64_t>(0, n[a] - side));
    for (std::int64_t z = first[2]; z < std::min(n[2], first[2] + side); ++z)
      for (std::int64_t y = first[1]; y < std::min(n[1], first[1] + side); ++y)
        for (std::int64_t x = first[0]; x < std::min(n[0], first[0] + side); ++x)
          if (looked_at[at(bricks.number({x, y, z}))]) selected[at(bricks.number({x, y, z}))] = 1;
  }
  return selected;
}

// Whether the grid keeps enough of the tolerance. Better interpolation in u costs little: what it leaves must
// not cost much of the tolerance, or the volume pays for it.
bool fits(const Rates& r, const Trial& t, double epsilon) {
  if (2.5 * t.projection > (r.interpolation == Interpolation::linear ? linear_share : cubic_share) * epsilon)
    return false;
  return 1.1 * t.slack + 4 * t.arithmetic <= share * epsilon;
}

// What build will need at least: its node test leaves out rounding, and of the rest what gold computed in
// other blocks may differ by. That T + P is larger elsewhere than in the trial, and what samplers take, build
// finds out.
double least_needed(const Trial& t, const Volume& base) {
  double largest = 0;
  for (const float v : base.samples) largest = std::max(largest, std::abs(static_cast<double>(v)));
  return t.slack + t.arithmetic + std::min(2 * t.arithmetic, 0x1p-15 * largest);
}

ToleranceError out_of_reach(const Chosen& finest, double needed, const TrialTolerance& tolerance) {
  const auto& [r, t] = finest;
  const auto world = [&](double x) { return to_world(x, tolerance.units); };
  return ToleranceError(fmt::format(
      "epsilon {:.4g} is out of reach: at upsampling {} {}, gold {}, {} may err by {:.4g} and rounding by "
      "{:.4g}; the smallest that would do is about {:.4g} ({:.3g} % of the range)",
      world(tolerance.epsilon_abs), r.upsampling, text_of(r.interpolation), r.gold,
      t.projection > t.gold ? "interpolating the projections" : "interpolating gold", world(t.slack),
      world(t.arithmetic), world(1.1 * needed), 100 * 1.1 * needed / tolerance.reference_range));
}

// Gold is kept, and what is between its nodes and the detector is not to be chosen.
std::vector<Rates> cone_candidates(const RateOptions& wanted) {
  constexpr Rates made{6, Interpolation::eight_taps, 8};
  if (wanted.upsampling.value_or(made.upsampling) != made.upsampling ||
      wanted.interpolation.value_or(made.interpolation) != made.interpolation)
    throw InputError(
        "cone beam: gold is interpolated by eight taps both ways on projections at 6x, and `upsampling` and "
        "`u_filter` cannot change that; leave them out");
  std::vector<Rates> out;
  for (const int gold : wanted.gold ? std::vector<int>{*wanted.gold} : std::vector<int>{8, 16, 32})
    out.push_back({made.upsampling, made.interpolation, gold});
  return out;
}

}  // namespace

std::vector<Rates> candidates(const RateOptions& wanted, bool cone) {
  if (cone) return cone_candidates(wanted);
  if (wanted.interpolation == Interpolation::eight_taps)
    throw InputError("`u_filter` eight-taps is of cone beam: parallel beam has linear, cubic and six-taps");
  const auto interpolation =
      wanted.upsampling.value_or(8) >= 8 ? Interpolation::six_taps : Interpolation::cubic;
  std::vector<Rates> all;
  for (const int gold : {8, 16, 32})
    for (const int upsampling : {8, 16, 32})
      all.push_back({upsampling, wanted.interpolation.value_or(interpolation), gold});
  for (Rates& r : all) {
    if (wanted.upsampling) r.upsampling = *wanted.upsampling;
    if (wanted.gold) r.gold = *wanted.gold;
  }
  std::vector<Rates> out;
  for (const Rates& r : all) {
    const bool same = std::find(out.begin(), out.end(), r) != out.end();
    // Six taps are as good at 8x as at any rate above.
    const bool finer =
        r.interpolation == Interpolation::six_taps && r.upsampling > wanted.upsampling.value_or(8);
    if (!same && !finer) out.push_back(r);
  }
  return out;
}

void check_rates(const RateOptions& rates) {
  if (rates.interpolation == Interpolation::six_taps && rates.upsampling && *rates.upsampling < 8)
    throw InputError(
        fmt::format("`u_filter` six-taps needs an `upsampling` of at least 8, not {}", *rates.upsampling));
  const auto power = [](int n, int low) {
    return n >= low && n <= 64 && std::has_single_bit(static_cast<unsigned>(n));
  };
  if (rates.upsampling && !power(*rates.upsampling, 2))
    throw InputError(fmt::format("`upsampling` {} must be a power of two, 2 to 64 (rate 1 has no bound)",
                                 *rates.upsampling));
  if (rates.gold && !power(*rates.gold, 2))
    throw InputError(fmt::format("`gold` {} must be a power of two, 2 to 64", *rates.gold));
}

Trial try_rates(opencl::State& state, GoldRates& gold, const Volume& base, double epsilon,
                std::span<const float> by_brick, const std::vector<std::uint8_t>& looked_at) {
  GoldStream& stream = gold.fine();
  const GoldSettings& settings = stream.settings();
  Trial t;
  t.arithmetic = gold.arithmetic();
  t.projection = gold.projection();
  const DeviceField field(state, as_mixed(base, settings.granularity));
  const auto selected = trial_bricks(settings.grid, settings.granularity, settings.rate, looked_at);
  const opencl::DeviceArray<std::uint8_t> device_selected(state, std::span<const std::uint8_t>(selected),
                                                          "trial bricks");
  const auto look_at = [&](const BrickMeasure& m) {
    if (m.total < 0) return;
    const double share = by_brick.empty() ? 1.0 : static_cast<double>(by_brick[at(m.brick)]);
    t.slack = std::max(t.slack, static_cast<double>(m.slack) / share);
  };
  stream.run_in_strands(
      selected,
      [&](GoldStream::Batch& batch) -> Take {
        return [&, found = batch.measure(field, static_cast<float>(epsilon), device_selected)] {
          std::ranges::for_each(found, look_at);
        };
      },
      {}, "trial");
  t.gold = std::max(0.0, t.slack - t.projection);
  return t;
}

void add_trial_bounds(std::vector<Bound>& bounds, const Rates& r, const Trial& t) {
  bounds.push_back({"projection",
                    fmt::format("sups, {} in u, filters between kept gold", text_of(r.interpolation)),
                    r.upsampling, t.projection, true});
  bounds.push_back({"gold",
                    fmt::format("second differences, node by node, u {}x {} (trial)", r.upsampling,
                                text_of(r.interpolation)),
                    r.gold, t.gold, true});
}

Chosen choose_rates(const std::vector<Rates>& all, const std::function<Trial(const Rates&)>& try_out,
                    const TrialTolerance& tolerance, const Progress& progress) {
  std::optional<Chosen> finest;
  for (const Rates& r : all) {
    const Trial t = try_out(r);
    if (!finest || t.slack < finest->trial.slack) finest = {r, t};
    if (tolerance.grid_only || fits(r, t, tolerance.epsilon_abs)) return {r, t};
    // A finer gold costs eight times as much: put up with a larger share before that.
    const bool last_of_gold = &r == &all.back() || (&r + 1)->gold > r.gold;
    if (last_of_gold &&
        1.1 * finest->trial.slack + 4 * finest->trial.arithmetic <= patient_share * tolerance.epsilon_abs)
      return *finest;
    report(progress, "plan", 0.7);
  }
  const double needed = least_needed(finest->trial, *tolerance.base);
  if (needed < tolerance.epsilon_abs) return *finest;
  throw out_of_reach(*finest, needed, tolerance);
}

}  // namespace vdvr
