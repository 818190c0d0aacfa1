#include "host/measure/measure_volume.hpp"

#include <fmt/format.h>

#include <cmath>

#include "vdvr/error.hpp"

namespace vdvr::measured {
namespace {

// What geometry may leave undecided beside what the bound leaves open: it makes intervals that much wider.
constexpr double open_share = 0.1;
// This share of what may stay undecided is aimed at: one pass mostly does, since parts are halved a little
// too often.
constexpr double margin = 1.1;
// What a pass may let the undecided fall by: only then is it known what the bound leaves open, which may be
// far more than what geometry may.
constexpr double most_at_once = 12;
constexpr int most_passes = 6;

double above(double x) { return std::nextafter(x, infinity); }
double below(double x) { return std::nextafter(x, -infinity); }

// Volumes of parts that are undecided, in steps of the square root of 1/2 from a cell of the grid's 4^3 on.
constexpr std::size_t volume_steps = 96;

/// Of a part or of many, in volumes.
struct Sums {
  Interval region{0, 0}, sure{0, 0}, possible{0, 0};
  double out = 0;  ///< surely in the region and surely not in the range
  /// Of the range and of the region itself, by what is undecided of one part.
  std::array<double, volume_steps> undecided{}, edge{};

  Sums& operator+=(const Sums& o) {
    for (auto [a, b] : {std::pair{&region, &o.region}, {&sure, &o.sure}, {&possible, &o.possible}}) {
      a->lo += b->lo;
      a->hi += b->hi;
    }
    out += o.out;
    for (std::size_t i = 0; i < volume_steps; ++i) {
      undecided[i] += o.undecided[i];
      edge[i] += o.edge[i];
    }
    return *this;
  }
};

Interval both(const Interval& a, const Interval& b) {
  return {std::max(0.0, a.lo + b.lo - 1), std::min(a.hi, b.hi)};
}

/// Parts are halved until what is undecided of one is at most that volume, of the range and of the region, or
/// it has been halved so often.
struct Fineness {
  double volume = 0, edge = 0;
  int halvings = 0;
};

class VolumeOfParts {
 public:
  /// `unit`: the volume of which parts' undecided volumes are counted in steps.
  VolumeOfParts(const MeasuredRegion& region, const Thresholds& t, const Fineness& fineness, double unit)
      : region_(region), t_(t), fineness_(fineness), unit_(unit) {}

  void add(const Part& part, bool whole, Sums& sums) const { add(part, whole, fineness_.halvings, sums); }

 private:
  void add(const Part& part, bool whole, int left, Sums& sums) const {
    const AffineForm form = affine_of(part.value);
    const double v = part.volume();
    if (whole && left > 0 && open_of(form) * v > fineness_.volume) {
      for (const Part& half : halves(part, axis_of(part, form, whole))) add(half, whole, left - 1, sums);
      return;
    }
    const RangeShares in = shares_in(form, t_);
    const Interval region = whole ? Interval{1, 1} : region_.share(part.low, part.high);
    const Interval sure = both(region, in.sure), possible = both(region, in.possible);
    const double open = std::max(sure.width(), possible.width());
    if (!whole && left > 0 && (open * v > fineness_.volume || region.width() * v > fineness_.edge)) {
      for (const Part& half : halves(part, axis_of(part, form, whole))) {
        const Place place = region_.place(half.low, half.high);
        if (place != Place::outside) add(half, place == Place::inside, left - 1, sums);
      }
      return;
    }
    sums.region.lo += region.lo * v;
    sums.region.hi += region.hi * v;
    sums.sure.lo += sure.lo * v;
    sums.sure.hi += sure.hi * v;
    sums.possible.lo += possible.lo * v;
    sums.possible.hi += possible.hi * v;
    sums.out += std::max(0.0, region.lo - in.possible.hi) * v;
    count(sums.undecided, open * v);
    count(sums.edge, region.width() * v);
  }
  void count(std::array<double, volume_steps>& steps, double volume) const {
    if (!(volume > 0)) return;
    const double step = std::max(0.0, -2 * std::log2(volume / unit_));
    steps[std::min(volume_steps - 1, static_cast<std::size_t>(step))] += volume;
  }
  [[nodiscard]] double open_of(const AffineForm& form) const {
    return std::max({open_near(form, t_.inner_least), open_near(form, t_.inner_largest),
                     open_near(form, t_.outer_least), open_near(form, t_.outer_largest)});
  }
  // Where V bends most; of what the region's edge cuts, the longest side.
  static std::size_t axis_of(const Part& part, const AffineForm& form, bool whole) {
    return whole ? most_bent(form) : longest_side(part);
  }

  const MeasuredRegion& region_;
  const Thresholds& t_;
  Fineness fineness_;
  double unit_;
};

double unit_of(const Field& field) {
  const Vec3& h = field.volume().grid.spacing;
  return 64 * h[0] * h[1] * h[2];
}

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
        for (auto [sum, more] : {std::pair{&sums.region, v}, {&sums.sure, in}, {&sums.possible, in}}) {
          sum->lo += more;
          sum->hi += more;
        }
        sums.out += v - in;
        return;
      }
    }
    const VolumeOfParts parts(field.region(), t, fineness, unit_of(field));
    for_parts(field.region(), cells, [&](const Part& part, bool whole) { parts.add(part, whole, sums); });
  });
}

/// The volume at which to stop halving, so that what is undecided falls by `excess`. Of n parts of a box that
/// a surface passes each leaves the n-th part of what one leaves of the n-th part: the sum is least for its
/// cost where all parts leave the same.
double volume_for(const std::array<double, volume_steps>& undecided, double excess, double unit) {
  double all = 0;
  for (const double u : undecided) all += u;
  double volume = unit;
  for (; volume > 0x1p-40 * unit; volume *= std::sqrt(0.5)) {
    double rest = 0;
    for (std::size_t i = 0; i < volume_steps; ++i) {
      const double now = unit * std::pow(0.5, 0.5 * static_cast<double>(i) + 0.25);
      rest += undecided[i] * std::min(1.0, std::sqrt(volume / now));
    }
    if (rest * excess <= margin * all) break;
  }
  return volume;
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
  VolumeOfParts(region, t, {}, part.volume()).add(part, whole, sums);
  return {sums.sure.lo, sums.possible.hi};
}

VolumeMeasure measure_volume(const Field& field, const ValueRange& range, const MeasureOptions& options,
                             const Progress& progress) {
  require_range(range);
  if (!(options.share > 0)) throw InputError(fmt::format("share: {} is not positive", options.share));
  Fineness fineness;
  const double unit = unit_of(field);
  Sums s = add_up(field, range, fineness, progress);
  // By what each must fall; at most 1 where it may stay.
  const auto excess = [&] {
    const double open = open_share * std::max(0.0, s.possible.lo - s.sure.hi);
    return (s.sure.width() + s.possible.width()) / std::max(options.share * s.possible.hi, open);
  };
  const auto edge_excess = [&] { return s.region.width() / (options.share * s.region.hi); };
  for (int pass = 0; pass < most_passes && (excess() > 1 || edge_excess() > 1); ++pass) {
    const Fineness next{volume_for(s.undecided, std::min(excess(), most_at_once), unit),
                        volume_for(s.edge, edge_excess(), unit), fineness.halvings + 9};
    if (pass == 0) fineness = next;
    else
      fineness = {std::min(next.volume, (excess() > 1 ? 0.5 : 1.0) * fineness.volume),
                  std::min(next.edge, (edge_excess() > 1 ? 0.5 : 1.0) * fineness.edge), next.halvings};
    s = add_up(field, range, fineness, progress);
  }
  VolumeMeasure out;
  out.region = outward(s.region);
  out.volume = outward({s.sure.lo, s.possible.hi});
  out.undecided = s.sure.width() + s.possible.width();
  // What surely is not in the range tells the largest fraction, too; the better counts.
  const double by_volume = out.region.lo > 0 ? out.volume.hi / out.region.lo : 1,
               by_rest = 1 - s.out * (1 - sum_error) / out.region.hi;
  out.fraction = {out.volume.lo / out.region.hi * (1 - sum_error),
                  std::min({1.0, by_volume * (1 + sum_error), by_rest + sum_error})};
  return out;
}

}  // namespace vdvr::measured
