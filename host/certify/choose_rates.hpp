// The rates of a plan: what a trial of some blocks of gold shows of each, and which of them leave room for
// the grid. All numbers in units of computation.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "host/certify/crew/gold_rates.hpp"
#include "host/scan/units.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/plan.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// What a trial of some blocks at given rates shows.
struct Trial {
  double slack = 0, projection = 0, gold = 0, arithmetic = 0;
};

/// The rates whose T, P and rounding a tolerance leaves room for, and what the trial of them showed.
struct Chosen {
  Rates rates;
  Trial trial;
};

/// Throws InputError for rates that are no powers of two, out of range or do not go together.
void check_rates(const RateOptions& rates);

/// Cheapest first: gold costs eight times per doubling. Six taps need columns at 8x; where fewer are asked
/// for, four.
std::vector<Rates> candidates(const RateOptions& wanted, bool cone);

/// Measures `base` on a few blocks of gold, around bricks that are looked at. `by_brick`: bricks' tolerances
/// in units of `epsilon`; where there are some, the slack is the largest in a brick over what it has of
/// these.
Trial try_rates(opencl::State& state, GoldRates& gold, const Volume& base, double epsilon,
                std::span<const float> by_brick, const std::vector<std::uint8_t>& looked_at);
void add_trial_bounds(std::vector<Bound>& bounds, const Rates& rates, const Trial& trial);

/// What rates are chosen for.
struct TrialTolerance {
  double epsilon_abs = 0, reference_range = 0;
  bool grid_only = false;  ///< no other term counts
  const Volume* base = nullptr;
  Units units;  ///< of messages
};

/// The cheapest rates whose slack leaves most of the tolerance to the grid; failing that, whatever fits at
/// all. Throws ToleranceError where nothing does.
Chosen choose_rates(const std::vector<Rates>& all, const std::function<Trial(const Rates&)>& try_out,
                    const TrialTolerance& tolerance, const Progress& progress);

}  // namespace vdvr
