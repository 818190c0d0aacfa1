#include "host/measure/measure_volume.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "vdvr/error.hpp"

namespace vdvr::measured {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
// What geometry may leave undecided beside what the bound leaves open: it makes intervals that much wider.
constexpr double open_share = 0.05;

double above(double x) { return std::nextafter(x, infinity); }
double below(double x) { return std::nextafter(x, -infinity); }

/// Of a part or of many, in volumes.
struct Sums {
  Interval region{0, 0}, sure{0, 0}, possible{0, 0};
  double out = 0;  ///< surely in the region and surely not in the range

  Sums& operator+=(const Sums& o) {
    for (auto [a, b] : {std::pair{&region, &o.region}, {&sure, &o.sure}, {&possible, &o.possible}}) {
      a->lo += b->lo;
      a->hi += b->hi;
    }
    out += o.out;
    return *this;
  }
};

Interval both(const Interval& a, const Interval& b) {
  return {std::max(0.0, a.lo + b.lo - 1), std::min(a.hi, b.hi)};
}

/// How parts are halved: until what is undecided is at most that share of a part, or it has been halved so
/// often.
struct Fineness {
  double share = 1;
  int halvings = 0;
};

class VolumeOfParts {
 public:
  VolumeOfParts(const MeasuredRegion& region, const Thresholds& t, const Fineness& fineness)
      : region_(region), t_(t), fineness_(fineness) {}

  void add(const Part& part, bool whole, Sums& sums) const { add(part, whole, fineness_.halvings, sums); }

 private:
  void add(const Part& part, bool whole, int left, Sums& sums) const {
    const RangeShares in = shares_in(affine_of(part.value), t_);
    const Interval region = whole ? Interval{1, 1} : region_.share(part.low, part.high);
    const Interval sure = both(region, in.sure), possible = both(region, in.possible);
    const double open = std::max({region.width(), sure.width(), possible.width()});
    if (left > 0 && open > fineness_.share) {
      for (const Part& half : halves(part)) {
        const Place place = whole ? Place::inside : region_.place(half.low, half.high);
        if (place != Place::outside) add(half, place == Place::inside, left - 1, sums);
      }
      return;
    }
    const double v = part.volume();
    sums += {{region.lo * v, region.hi * v},
             {sure.lo * v, sure.hi * v},
             {possible.lo * v, possible.hi * v},
             std::max(0.0, region.lo - in.possible.hi) * v};
  }

  const MeasuredRegion& region_;
  const Thresholds& t_;
  Fineness fineness_;
};

Sums add_up(const Field& field, const ValueRange& range, const Fineness& fineness, const Progress& progress) {
  return field.sum_over_bricks(Sums{}, progress, "measure", [&](const BrickCells& cells, Sums& sums) {
    const Thresholds t = thresholds_of(range, cells.bound);
    const auto least = static_cast<double>(cells.least), largest = static_cast<double>(cells.largest);
    if (cells.place == Place::inside) {
      // Bricks that lie on one side are most of a volume.
      const bool sure = least >= t.inner_least && largest <= t.inner_largest,
                 out = largest < t.outer_least || least > t.outer_largest;
      if (sure || out) {
        const Vec3 low = cells.low(), high = cells.high();
        const double v = (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]), in = sure ? v : 0;
        sums += {{v, v}, {in, in}, {in, in}, v - in};
        return;
      }
    }
    const VolumeOfParts parts(field.region(), t, fineness);
    for_parts(field.region(), cells, [&](const Part& part, bool whole) { parts.add(part, whole, sums); });
  });
}

}  // namespace

void require_range(const ValueRange& range) {
  if (!range.least && !range.largest) throw InputError("the range of values has neither end");
  for (const auto& end : {range.least, range.largest})
    if (end && !std::isfinite(*end)) throw InputError(fmt::format("the value {} is no finite number", *end));
  if (range.least && range.largest && !(*range.least < *range.largest))
    throw InputError(fmt::format("the range from {} to {} is empty; give the smaller value first",
                                 *range.least, *range.largest));
}

Thresholds thresholds_of(const ValueRange& range, double bound) {
  Thresholds t{-infinity, infinity, -infinity, infinity};
  if (range.least) {
    t.inner_least = above(*range.least + bound);
    t.outer_least = below(*range.least - bound);
  }
  if (range.largest) {
    t.inner_largest = below(*range.largest - bound);
    t.outer_largest = above(*range.largest + bound);
  }
  return t;
}

// {V >= a} less {V > b}; that a plane has no volume lets >= stand for >.
RangeShares shares_in(const AffineForm& form, const Thresholds& t) {
  const auto between = [&](double a, double b) -> Interval {
    if (!(a < b)) return {0, 0};
    const Interval from = a == -infinity ? Interval{1, 1} : share_above(form, a),
                   beyond = b == infinity ? Interval{0, 0} : share_above(form, b);
    return {std::max(0.0, from.lo - beyond.hi), std::max(0.0, from.hi - beyond.lo)};
  };
  return {between(t.inner_least, t.inner_largest), between(t.outer_least, t.outer_largest)};
}

Interval volume_of_part(const MeasuredRegion& region, const Part& part, bool whole, const Thresholds& t) {
  Sums sums;
  VolumeOfParts(region, t, {}).add(part, whole, sums);
  return {sums.sure.lo, sums.possible.hi};
}

VolumeMeasure measure_volume(const Field& field, const ValueRange& range, const MeasureOptions& options,
                             const Progress& progress) {
  require_range(range);
  if (!(options.share > 0)) throw InputError(fmt::format("share: {} is not positive", options.share));
  // A cell that is halved three times is eight of half the side, of which a surface cuts about four.
  constexpr std::array<Fineness, 6> passes{Fineness{1, 0}, {0.1, 3},    {0.03, 6},
                                           {0.01, 9},      {0.003, 12}, {0.001, 15}};
  Sums s;
  double undecided = 0;
  for (const Fineness& fineness : passes) {
    s = add_up(field, range, fineness, progress);
    undecided = s.sure.width() + s.possible.width();
    const double open = std::max(0.0, s.possible.lo - s.sure.hi);
    if (undecided <= std::max(options.share * s.possible.hi, open_share * open) &&
        s.region.width() <= options.share * s.region.hi)
      break;
  }
  VolumeMeasure out;
  out.region = outward(s.region);
  out.volume = outward({s.sure.lo, s.possible.hi});
  out.undecided = undecided;
  // What surely is not in the range tells the largest fraction, too; the better counts.
  const double by_volume = out.region.lo > 0 ? out.volume.hi / out.region.lo : 1,
               by_rest = 1 - s.out * (1 - sum_error) / out.region.hi;
  out.fraction = {out.volume.lo / out.region.hi * (1 - sum_error),
                  std::min({1.0, by_volume * (1 + sum_error), by_rest + sum_error})};
  return out;
}

}  // namespace vdvr::measured
