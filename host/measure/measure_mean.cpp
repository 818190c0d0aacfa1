// The integral of a trilinear function over a box is its volume times the mean of its corners. Of a box that
// the region's edge cuts, it is between the volumes of the part times the ends of V there.
#include "host/measure/measure_mean.hpp"

#include <cmath>

#include "vdvr/error.hpp"

namespace vdvr::measured {
namespace {

// Cut cells are halved so often at most: twice a side.
constexpr int cut_halvings = 6;

double mean_of(const Part& part) {
  double sum = 0;
  for (const double v : part.value) sum += v;
  return sum / 8;
}

struct MeanSums {
  Interval value{0, 0}, region{0, 0};  ///< integral of V - reference; volume
  double bound = 0, size = 0;  ///< integral of e at most, of |V - reference|: what rounding is a part of

  MeanSums& operator+=(const MeanSums& o) {
    value.lo += o.value.lo;
    value.hi += o.value.hi;
    region.lo += o.region.lo;
    region.hi += o.region.hi;
    bound += o.bound;
    size += o.size;
    return *this;
  }
  void add_whole(double volume, double value_less_reference, double largest, double e) {
    value.lo += volume * value_less_reference;
    value.hi += volume * value_less_reference;
    region.lo += volume;
    region.hi += volume;
    bound += volume * e;
    size += volume * largest;
  }
  void add_cut(double volume, const Interval& share, const Interval& v, double e) {
    value.lo += volume * std::min(share.lo * v.lo, share.hi * v.lo);
    value.hi += volume * std::max(share.lo * v.hi, share.hi * v.hi);
    region.lo += volume * share.lo;
    region.hi += volume * share.hi;
    bound += volume * share.hi * e;
    size += volume * std::max(std::abs(v.lo), std::abs(v.hi));
  }
};

class MeanOfParts {
 public:
  MeanOfParts(const MeasuredRegion& region, double reference, double bound)
      : region_(region), reference_(reference), bound_(bound) {}

  void add(const Part& part, bool whole, MeanSums& sums, int left = cut_halvings) const {
    const double v = part.volume();
    const auto [least, largest] = std::minmax_element(part.value.begin(), part.value.end());
    const Interval range{*least - reference_, *largest - reference_};
    if (whole) {
      sums.add_whole(v, mean_of(part) - reference_, std::max(std::abs(range.lo), std::abs(range.hi)), bound_);
      return;
    }
    const Interval share = region_.share(part.low, part.high);
    // What is left open beside what the bound leaves.
    const double open = share.width() * std::max(std::abs(range.lo), std::abs(range.hi)) + range.width();
    if (left > 0 && open > fine_ * bound_) {
      for (const Part& half : halves(part, longest_side(part))) {
        const Place place = region_.place(half.low, half.high);
        if (place != Place::outside) add(half, place == Place::inside, sums, left - 1);
      }
      return;
    }
    sums.add_cut(v, share, range, bound_);
  }

 private:
  static constexpr double fine_ = 0.05;
  const MeasuredRegion& region_;
  double reference_, bound_;
};

MeanSums add_up(const Field& field, double reference, const Progress& progress) {
  return field.sum_over_bricks(MeanSums{}, progress, "measure", [&](const BrickCells& cells, MeanSums& sums) {
    const MeanOfParts parts(field.region(), reference, cells.bound);
    for_parts(field.region(), cells, [&](const Part& part, bool whole) { parts.add(part, whole, sums); });
  });
}

// An interval over one that is positive.
Interval quotient(const Interval& a, const Interval& b) {
  const Interval q{std::min(a.lo / b.lo, a.lo / b.hi), std::max(a.hi / b.lo, a.hi / b.hi)};
  return {q.lo - std::abs(q.lo) * sum_error, q.hi + std::abs(q.hi) * sum_error};
}

Interval integral_of(const MeanSums& s) {
  const double more = s.bound + sum_error * (s.bound + s.size);
  return {s.value.lo - more, s.value.hi + more};
}

struct Ends {
  // F's least is between low.lo and low.hi; at: where V is.
  Interval least{infinity, infinity}, largest{-infinity, -infinity};
  double v_least = infinity, v_largest = -infinity;
  Vec3 least_at{}, largest_at{};

  Ends& operator+=(const Ends& o) {
    least = {std::min(least.lo, o.least.lo), std::min(least.hi, o.least.hi)};
    largest = {std::max(largest.lo, o.largest.lo), std::max(largest.hi, o.largest.hi)};
    if (o.v_least < v_least) {
      v_least = o.v_least;
      least_at = o.least_at;
    }
    if (o.v_largest > v_largest) {
      v_largest = o.v_largest;
      largest_at = o.largest_at;
    }
    return *this;
  }
};

/// Both ends at once: a part can raise the largest or lower the least.
class EndsOfParts {
 public:
  EndsOfParts(const MeasuredRegion& region, double bound) : region_(region), bound_(bound) {}

  /// Whether values in a range leave all ends as they are.
  [[nodiscard]] bool adds_nothing(double least, double largest, const Ends& ends) const {
    const double lost = lost_of(least, largest);
    return least - bound_ - lost >= ends.least.lo && largest + bound_ + lost <= ends.largest.hi &&
           least + bound_ >= ends.least.hi && largest - bound_ <= ends.largest.lo && least >= ends.v_least &&
           largest <= ends.v_largest;
  }
  void add(const Part& part, bool whole, Ends& ends, int left = cut_halvings) const {
    const auto [least, largest] = std::minmax_element(part.value.begin(), part.value.end());
    if (adds_nothing(*least, *largest, ends)) return;
    const double lost = lost_of(*least, *largest);
    if (!whole && left > 0) {
      for (const Part& half : halves(part, longest_side(part))) {
        const Place place = region_.place(half.low, half.high);
        if (place != Place::outside) add(half, place == Place::inside, ends, left - 1);
      }
      return;
    }
    ends.least.lo = std::min(ends.least.lo, *least - bound_ - lost);
    ends.largest.hi = std::max(ends.largest.hi, *largest + bound_ + lost);
    if (whole) take_attained(part, lost, ends);
    else take_point(part, lost, ends);
  }

 private:
  // What interpolation in double precision may have lost.
  static double lost_of(double least, double largest) {
    return 0x1p-40 * std::max(std::abs(least), std::abs(largest));
  }
  static Vec3 corner(const Part& part, std::size_t i) {
    return {(i & 1) ? part.high[0] : part.low[0], (i & 2) ? part.high[1] : part.low[1],
            (i & 4) ? part.high[2] : part.low[2]};
  }
  void take(double v, const Vec3& p, double lost, Ends& ends) const {
    ends.least.hi = std::min(ends.least.hi, v + bound_ + lost);
    ends.largest.lo = std::max(ends.largest.lo, v - bound_ - lost);
    if (v < ends.v_least) {
      ends.v_least = v;
      ends.least_at = p;
    }
    if (v > ends.v_largest) {
      ends.v_largest = v;
      ends.largest_at = p;
    }
  }
  void take_attained(const Part& part, double lost, Ends& ends) const {
    for (std::size_t i = 0; i < 8; ++i) take(part.value[i], corner(part, i), lost, ends);
  }
  // Of a part that the edge cuts: its corners inside, else what any point of it has.
  void take_point(const Part& part, double lost, Ends& ends) const {
    for (std::size_t i = 0; i < 8; ++i) {
      const Vec3 p = corner(part, i);
      if (region_.holds_point(p, p)) take(part.value[i], p, lost, ends);
    }
    if (!region_.holds_point(part.low, part.high)) return;
    const auto [least, largest] = std::minmax_element(part.value.begin(), part.value.end());
    ends.least.hi = std::min(ends.least.hi, *largest + bound_ + lost);
    ends.largest.lo = std::max(ends.largest.lo, *least - bound_ - lost);
  }

  const MeasuredRegion& region_;
  double bound_;
};

}  // namespace

MeanMeasure measure_mean(const Field& field, const Progress& progress) {
  const MeanSums plain = add_up(field, 0, progress);
  MeanMeasure out;
  out.region = outward(plain.region);
  if (!(out.region.lo > 0)) throw InputError("the region is too small to have a mean");
  out.integral = integral_of(plain);
  // A mean in deviations from a value near it: the region's own volume need not be known as well.
  const double reference = plain.value.middle() / plain.region.middle();
  const MeanSums s = add_up(field, reference, progress);
  const Interval deviation = quotient(integral_of(s), out.region);
  const double lost = sum_error * std::abs(reference);
  out.mean = {reference + deviation.lo - lost, reference + deviation.hi + lost};
  out.bound = s.bound / s.region.middle();
  return out;
}

ExtremesMeasure measure_extremes(const Field& field, const Progress& progress) {
  const Ends ends =
      field.sum_over_bricks(Ends{}, progress, "measure", [&](const BrickCells& cells, Ends& sum) {
        const EndsOfParts parts(field.region(), cells.bound);
        if (parts.adds_nothing(static_cast<double>(cells.least), static_cast<double>(cells.largest), sum))
          return;
        for_parts(field.region(), cells, [&](const Part& part, bool whole) { parts.add(part, whole, sum); });
      });
  if (!(ends.largest.lo > -infinity) || !(ends.least.hi < infinity))
    throw InputError("the region is too small: no point is surely in it");
  return {ends.least, ends.largest, ends.least_at, ends.largest_at};
}

}  // namespace vdvr::measured
