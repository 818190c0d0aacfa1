#include "host/certify/bounds/remainder_norms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <numbers>
#include <tuple>
#include <vector>

#include "host/base/system/parallel.hpp"
#include "host/certify/bounds/node_functional.hpp"
#include "host/certify/bounds/tap_design.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

void check(double band, int taps, double eta) {
  if (!(band > 0) || band > std::numbers::pi / 2)
    throw InputError(
        fmt::format("remainder norms for the band {}: it must be above 0, at most pi / 2", band));
  if (taps < 4 || taps > 32 || taps % 2 != 0)
    throw InputError(fmt::format("remainder norms of {} taps: it must be an even number, 4 to 32", taps));
  if (!(eta >= 1e-5) || eta > 0.1)
    throw InputError(fmt::format("remainder norms with an error of {}: it must be 1e-5 to 0.1", eta));
}

// Taps on differences, as taps on the nodes: which stand for the derivative of that order.
NodeFunctional on_nodes(const TapTask& task, std::vector<double> taps) {
  for (int k = 0; k < task.order; ++k) {
    taps.push_back(0);
    for (std::size_t i = taps.size(); i-- > 1;) taps[i] = taps[i - 1] - taps[i];
    taps[0] = -taps[0];
  }
  return {std::move(taps), 1 - task.taps / 2 - task.order / 2 - task.place, task.order};
}

struct Functional {
  double norm = 0, eta = 0, sup = 0;
};

// The largest over positions `step` apart in [0, 1 / 2], which mirrored are those in [1 / 2, 1]. Between two
// of them stand their taps' means, so that the norm is at most the larger. The mean stands for the mean of
// two values of the derivative, which differs from the derivative between them by (band step)^2 / 8 of a
// wave, and by that times band^order of sup |f|.
Functional over_positions(int order, double band, int taps, double eta, int intervals) {
  const double step = 0.5 / intervals, between = band * band * step * step / 8;
  std::vector<Functional> at(static_cast<std::size_t>(intervals) + 1);
  parallel_for(intervals + 1, {}, "", [&](std::int64_t s) {
    const TapTask task{taps, step * static_cast<double>(s), band, order};
    const double asked = 0.98 * (eta - between);
    std::vector<double> h = least_error_taps(task, asked / 4);
    h = least_norm_taps(task, std::max(1.3 * relative_error(task, h), asked), h);
    Functional& f = at[static_cast<std::size_t>(s)];
    for (const double x : h) f.norm += std::abs(x);
    f.eta = relative_error(task, h) + between;
    f.sup = sup_constant(on_nodes(task, h), band) + between * std::pow(band, order);
  });
  Functional largest;
  for (const Functional& f : at) {
    largest.norm = std::max(largest.norm, f.norm);
    largest.eta = std::max(largest.eta, f.eta);
    largest.sup = std::max(largest.sup, f.sup);
  }
  return largest;
}

RemainderNorms compute(double band, int taps, double eta) {
  // As many positions as leave four fifths of eta to the taps: (band / 2 n)^2 / 8 <= eta / 5.
  const int intervals = static_cast<int>(std::ceil(band / 2 * std::sqrt(5 / (8 * eta))));
  const Functional a = over_positions(0, band, taps, eta, intervals);
  const Functional b = over_positions(2, band, taps, eta, intervals);
  const Functional d = over_positions(4, band, taps, eta, intervals);
  RemainderNorms norms;
  norms.taps = taps;
  norms.band = band;
  norms.value = a.norm;
  norms.second = b.norm;
  norms.fourth = d.norm;
  norms.eta = std::max({a.eta, b.eta, d.eta});
  norms.value_sup = a.sup;
  norms.second_sup = b.sup;
  norms.fourth_sup = d.sup;
  return norms;
}

}  // namespace

RemainderNorms remainder_norms(double band, int taps, double eta) {
  check(band, taps, eta);
  static std::mutex mutex;
  static std::map<std::tuple<double, int, double>, RemainderNorms> known;
  const std::tuple key{band, taps, eta};
  {
    const std::lock_guard lock(mutex);
    if (const auto found = known.find(key); found != known.end()) return found->second;
  }
  const RemainderNorms norms = compute(band, taps, eta);
  const std::lock_guard lock(mutex);
  return known.emplace(key, norms).first->second;
}

double pure_factor(const RemainderNorms& along, const RemainderNorms& across, const RemainderNorms& other) {
  return along.fourth * across.value * other.value;
}

double mixed_factor(const RemainderNorms& first, const RemainderNorms& second, const RemainderNorms& across) {
  return first.second * second.second * across.value;
}

// d (x) a (x) a is a derivative, at most band^4 sup |f| (Bernstein), and three errors: the product of what
// each may be, but for the derivative itself.
double pure_tail(const RemainderNorms& along, const RemainderNorms& across, const RemainderNorms& other) {
  const double derivative = std::pow(along.band, 4);
  return (derivative + along.fourth_sup) * (1 + across.value_sup) * (1 + other.value_sup) - derivative;
}

double mixed_tail(const RemainderNorms& first, const RemainderNorms& second, const RemainderNorms& across) {
  const double one = first.band * first.band, two = second.band * second.band;
  return (one + first.second_sup) * (two + second.second_sup) * (1 + across.value_sup) - one * two;
}

}  // namespace vdvr
