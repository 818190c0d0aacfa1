#include "host/certify/kept/projective_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "host/base/system/parallel.hpp"

namespace vdvr {
namespace {

constexpr std::size_t bands = ProjectiveError::bands;

std::vector<double> all_bands(double highest) {
  std::vector<double> out;
  for (std::size_t band = 0; band < bands; ++band)
    out.push_back(highest * (static_cast<double>(band) + 0.5) / bands);
  return out;
}

// Filters of several rates have phases in common, and a plan's are those of the build: some thousand are
// remembered, then all are forgotten. `phase` is of order 0.
std::vector<double> known_constants(const NodeFunctional& phase, double band, std::size_t moments) {
  constexpr std::size_t most = 4096;
  static std::mutex mutex;
  static std::map<std::tuple<std::vector<double>, double, double, std::size_t>, std::vector<double>> known;
  const std::tuple key{phase.taps, phase.first, band, moments};
  {
    const std::scoped_lock lock(mutex);
    if (const auto found = known.find(key); found != known.end()) return found->second;
  }
  std::vector<double> made = moment_sup_constants(phase, band, moments);
  const std::scoped_lock lock(mutex);
  if (known.size() >= most) known.clear();
  return known.emplace(key, std::move(made)).first->second;
}

}  // namespace

ProjectiveError::ProjectiveError(const GoldFilter& filter, double highest)
    : ProjectiveError(filter, highest, all_bands(highest), most_moments) {}

ProjectiveError::ProjectiveError(const GoldFilter& filter, double highest, std::span<const double> for_bands,
                                 std::size_t of_moments)
    : highest_(highest), reach_(0.5 * filter.taps), norm_(filter.norm) {
  if (filter.rate == 1) return;
  constants_.assign(bands, {});
  std::vector<std::size_t> places;
  for (const double band : for_bands)
    if (const std::size_t place = place_of(band, highest); constants_[place].empty()) {
      constants_[place].assign(of_moments, 0.0);
      places.push_back(place);
    }
  // Other phases mirror these, and what a filter errs of a mirrored function is the same.
  const auto phases = static_cast<std::size_t>(filter.rate / 2);
  std::vector<std::vector<double>> found(places.size() * phases);
  parallel_for(static_cast<std::int64_t>(found.size()), {}, "", [&](std::int64_t n) {
    const auto i = static_cast<std::size_t>(n);
    found[i] = known_constants(functional(filter, static_cast<int>(i % phases) + 1),
                               highest * static_cast<double>(places[i / phases] + 1) / bands, of_moments);
  });
  for (std::size_t i = 0; i < found.size(); ++i)
    std::ranges::transform(constants_[places[i / phases]], found[i], constants_[places[i / phases]].begin(),
                           [](double a, double b) { return std::max(a, b); });
}

std::size_t ProjectiveError::place_of(double band, double highest) {
  return static_cast<std::size_t>(
      std::clamp(std::ceil(band / highest * bands - 1), 0.0, static_cast<double>(bands - 1)));
}

double ProjectiveError::at(double band, double rho) const {
  if (constants_.empty()) return 0;
  const double growth = std::abs(rho) * reach_;
  if (!(band <= highest_ * (1 + 1e-12)) || !(growth < 0.5)) return HUGE_VAL;
  // All terms by magnitude add up to `all`. Where a moment's constant is known, a term is less than that:
  // what they are less is taken off. Terms beyond these keep their magnitudes, and so do those of some 1e-13
  // of the whole, where an error is 1e-7 at least.
  const double exponent = band * reach_ * growth / (1 - growth);
  const double all = norm_ * std::exp(exponent) / ((1 - growth) * (1 - growth)), negligible = 0x1p-44 * all;
  const std::vector<double>& known = constants_[place_of(band, highest_)];
  if (known.empty()) return HUGE_VAL;
  double less = norm_ - known[0];    // which may be more, as bounds are
  double of_m = 1, power_m = norm_;  // (|rho| band)^m / m!, and norm reach^2m
  for (std::size_t m = 0; 2 * m < known.size() && of_m * power_m > negligible; ++m) {
    double of_i = of_m, power = power_m;  // times C(m + 1 + i, i) |rho|^i, and reach^i
    for (std::size_t i = 0; 2 * m + i < known.size() && of_i * power > negligible; ++i) {
      if (m + i > 0) less += of_i * std::max(0.0, power - known[2 * m + i]);
      of_i *= std::abs(rho) * static_cast<double>(m + 2 + i) / static_cast<double>(i + 1);
      power *= reach_;
    }
    of_m *= std::abs(rho) * band / static_cast<double>(m + 1);
    power_m *= reach_ * reach_;
  }
  // At most 81 terms of at most 90 roundings each, whose sum is at most `all`; the exponent, at most 38, of
  // eight: fewer than 500 u of `all`.
  return all - less + all * 0x1p-44;
}

double sum_of_errors(std::span<const ViewAtPart> part, const ProjectiveError& error) {
  double sum = 0;
  for (const ViewAtPart& view : part)
    if (view.weight != 0) sum += view.weight * error.at(view.band, view.rho);  // 0, if of infinity
  return sum;
}

// Views whose bands have the same constants err by no more than the largest band and growth among them would.
// Errors that leave out what is negligible fall with neither by more than the 2^-44 that `at` adds.
double most_of_errors(std::span<const ViewAtPart> part, const ProjectiveError& error) {
  std::array<ViewAtPart, bands> alike{};
  for (const ViewAtPart& view : part) {
    ViewAtPart& most = alike[ProjectiveError::place_of(view.band, error.highest())];
    most = {most.weight + view.weight, std::max(most.band, view.band),
            std::max(most.rho, std::abs(view.rho))};
  }
  return sum_of_errors(alike, error) * (1 + 1e-12);
}

// Most parts lie below the largest by their bounds.
double largest_of_errors(std::span<const std::vector<ViewAtPart>> parts, const ProjectiveError& error) {
  std::vector<std::pair<double, std::size_t>> order(parts.size());
  parallel_for(std::ssize(parts), {}, "", [&](std::int64_t i) {
    const auto part = static_cast<std::size_t>(i);
    order[part] = {most_of_errors(parts[part], error), part};
  });
  std::ranges::sort(order, std::greater<>{});
  double largest = 0;
  constexpr std::size_t together = 16;
  for (std::size_t first = 0; first < order.size() && order[first].first > largest; first += together) {
    std::vector<double> sums(std::min(together, order.size() - first), 0.0);
    parallel_for(std::ssize(sums), {}, "", [&](std::int64_t i) {
      const auto n = static_cast<std::size_t>(i);
      sums[n] = sum_of_errors(parts[order[first + n].second], error);
    });
    largest = std::max(largest, *std::ranges::max_element(sums));
  }
  return largest * (1 + 1e-12);
}

}  // namespace vdvr
