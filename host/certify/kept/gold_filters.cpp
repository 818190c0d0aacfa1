#include "host/certify/kept/gold_filters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <mutex>
#include <span>
#include <tuple>
#include <utility>

#include "host/certify/bounds/tap_design.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

void check(int rate, double band, int taps) {
  if (rate < 1 || rate > most_gold_phases || (rate & (rate - 1)) != 0)
    throw InputError(fmt::format("a filter of rate {}: it must be 1, 2, 4, 8, 16 or 32", rate));
  if (!(band > 0) || band > highest_gold_band)
    throw InputError(fmt::format("a filter for the band {}: it must be above 0, at most 3/4 pi", band));
  if (taps < 2 || taps > 32 || taps % 2 != 0)
    throw InputError(fmt::format("a filter of {} taps: it must be an even number, 2 to 32", taps));
}

// Where the taps could do better than fp32 holds them, they are designed for a wider band, where their error
// is about tan(band / 4)^taps = 1e-8. Else they would be nearly free, and neighbouring phases unlike each
// other.
double design_band(const GoldFilter& filter) {
  return std::max(filter.band, 4 * std::atan(std::pow(1e-8, 1.0 / filter.taps)));
}

// A phase: its taps, and what it errs.
struct Phase {
  std::vector<float> taps;
  double error = 0, sup = 0, norm = 0;
};

Phase design_phase(const GoldFilter& filter, double place) {
  const std::vector<double> h = least_error_taps({filter.taps, place, design_band(filter), 0});
  const std::size_t taps = h.size();
  Phase out;
  NodeFunctional at{{}, filter.first() - place, 0};
  for (std::size_t i = 0; i < taps; ++i) {
    out.taps.push_back(static_cast<float>(place == 0.5 ? (h[i] + h[taps - 1 - i]) / 2 : h[i]));
    at.taps.push_back(static_cast<double>(out.taps.back()));
    out.norm += std::abs(at.taps.back());
  }
  out.error = largest_symbol_error(at, filter.band);
  out.sup = sup_constant(at, filter.band);
  return out;
}

// Filters of several rates for a band share places: those of the last few bands are remembered.
Phase known_phase(const GoldFilter& filter, double place) {
  constexpr std::size_t most = 1024;
  static std::mutex mutex;
  static std::map<std::tuple<int, double, double>, Phase> known;
  const std::tuple key{filter.taps, filter.band, place};
  {
    const std::scoped_lock lock(mutex);
    if (const auto found = known.find(key); found != known.end()) return found->second;
  }
  Phase made = design_phase(filter, place);
  const std::scoped_lock lock(mutex);
  if (known.size() >= most) known.clear();
  return known.emplace(key, std::move(made)).first->second;
}

// Largest sum of magnitudes, over positions of the finer lattice, of the difference of its interpolants.
double difference_norm(const GoldFilter& filter, std::span<const double> difference) {
  const int reach = static_cast<int>(difference.size()) / 2, wide = filter.taps + 2 * reach;
  double largest = 0;
  for (int centre = 0; centre < filter.rate; ++centre) {
    std::vector<double> sum(static_cast<std::size_t>(wide), 0.0);
    for (int k = -reach; k <= reach; ++k) {
      const int place = centre + k + reach * filter.rate;  // of the finer lattice, counted from node -reach
      for (int i = 0; i < filter.taps; ++i)
        sum[static_cast<std::size_t>(place / filter.rate + i)] +=
            difference[static_cast<std::size_t>(k + reach)] *
            static_cast<double>(
                filter.weights[static_cast<std::size_t>(place % filter.rate * filter.taps + i)]);
    }
    double norm = 0;
    for (const double s : sum) norm += std::abs(s);
    largest = std::max(largest, norm);
  }
  return largest;
}

}  // namespace

NodeFunctional functional(const GoldFilter& filter, int phase) {
  const auto taps = static_cast<std::size_t>(filter.taps);
  const auto h = std::span(filter.weights).subspan(static_cast<std::size_t>(phase) * taps, taps);
  return {{h.begin(), h.end()}, filter.first() - static_cast<double>(phase) / filter.rate, 0};
}

GoldFilter design_gold_filter(int rate, double band, int taps) {
  check(rate, band, taps);
  GoldFilter filter;
  filter.rate = rate;
  filter.taps = taps;
  filter.band = band;
  filter.weights.assign(static_cast<std::size_t>(rate * taps), 0.0F);
  filter.weights[static_cast<std::size_t>(-filter.first())] = 1;
  for (int phase = 1; 2 * phase <= rate; ++phase) {
    const Phase made = known_phase(filter, static_cast<double>(phase) / rate);
    const auto row = [&](int p) { return filter.weights.begin() + std::ptrdiff_t{p} * taps; };
    std::ranges::reverse_copy(made.taps, row(rate - phase));  // mirrored; the middle one is its own
    std::ranges::copy(made.taps, row(phase));
    filter.error = std::max(filter.error, made.error);
    filter.sup = std::max(filter.sup, made.sup);
    filter.norm = std::max(filter.norm, made.norm);
  }
  filter.second_difference = difference_norm(filter, std::array{1.0, -2.0, 1.0});
  filter.fourth_difference = difference_norm(filter, std::array{1.0, -4.0, 6.0, -4.0, 1.0});
  return filter;
}

}  // namespace vdvr
