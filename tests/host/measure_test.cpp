// What is measured of mixed volumes, held to analytic fields whose distance from V is known brick by brick,
// and to adversaries within the bound. VDVR_MEASURE_FIELDS asks for more fields than the few of every run.
#define BOOST_TEST_MODULE measure
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <limits>

#include "host/measure/level_share.hpp"
#include "tests/support/measured_fields.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/measure.hpp"
#include "vdvr/expert/measure_line.hpp"

using namespace vdvr;
using reference::TruthBox;
using support::MeasuredCase;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
// Of a brick of 4 cells: truth down to an eighth of a cell.
constexpr int depth = 5;

bool overlap(const Interval& a, const Interval& b) { return a.lo <= b.hi && a.hi >= b.lo; }

reference::RangeOn range_of(const MeasuredCase& c) {
  return [&c](const TruthBox& b) { return c.field.range(b); };
}

double value_in(MeasuredCase& c, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(c.random);
}

/// A box in `count` parts along each axis.
std::vector<TruthBox> parts_of(const TruthBox& box, const Index3& count) {
  std::vector<TruthBox> out;
  for (std::int64_t i = 0; i < count[0] * count[1] * count[2]; ++i) {
    TruthBox part;
    const Index3 at{i % count[0], i / count[0] % count[1], i / (count[0] * count[1])};
    for (std::size_t a = 0; a < 3; ++a) {
      const double side = (box.high[a] - box.low[a]) / static_cast<double>(count[a]);
      part.low[a] = box.low[a] + static_cast<double>(at[a]) * side;
      part.high[a] = part.low[a] + side;
    }
    out.push_back(part);
  }
  return out;
}

/// Bricks cut along their cells, so that V is trilinear on each.
std::vector<TruthBox> cells_of(const MeasuredCase& c) {
  std::vector<TruthBox> out;
  const Index3 n = c.volume.bricks();
  for (std::int64_t i = 0; i < c.volume.brick_count(); ++i) {
    const TruthBox box = c.brick_box({i % n[0], i / n[0] % n[1], i / (n[0] * n[1])});
    const LevelTriple l = c.volume.level[static_cast<std::size_t>(i)];
    Index3 count{};
    for (std::size_t a = 0; a < 3; ++a)
      count[a] = std::lround(std::ldexp((box.high[a] - box.low[a]) / c.volume.grid.spacing[a],
                                        l[2 - a] - c.volume.coarsening[2 - a]));
    std::ranges::copy(parts_of(box, count), std::back_inserter(out));
  }
  return out;
}

TruthBox middle_of(const TruthBox& b) {
  TruthBox point;
  for (std::size_t a = 0; a < 3; ++a) point.low[a] = point.high[a] = 0.5 * (b.low[a] + b.high[a]);
  return point;
}

/// V + sign e on boxes within cells: between the corners' values.
reference::RangeOn adversary(const MeasuredCase& c, double sign) {
  return [&c, sign](const TruthBox& b) {
    Vec3 middle{};
    for (std::size_t a = 0; a < 3; ++a) middle[a] = 0.5 * (b.low[a] + b.high[a]);
    const Vec3 m = c.cells_of(middle);
    const Index3 brick{reference::brick_of(c.volume, 0, m[0]), reference::brick_of(c.volume, 1, m[1]),
                       reference::brick_of(c.volume, 2, m[2])};
    Interval r{infinity, -infinity};
    for (int i = 0; i < 8; ++i) {
      const Vec3 p{(i & 1) != 0 ? b.high[0] : b.low[0], (i & 2) != 0 ? b.high[1] : b.low[1],
                   (i & 4) != 0 ? b.high[2] : b.low[2]};
      const double v = reference::field_of_brick(c.volume, brick, c.cells_of(p)) + sign * c.bound(middle);
      r = {std::min(r.lo, v), std::max(r.hi, v)};
    }
    return r;
  };
}

}  // namespace

BOOST_AUTO_TEST_CASE(share_of_a_box_above_a_value_lies_in_its_interval) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int sharp = 0;
  for (int i = 0; i < 400; ++i) {
    // Affine ones, steep along one axis or two, and trilinear ones.
    Corners corners{};
    const double bend = i % 4 == 0 ? 0 : i % 4 == 1 ? 0.05 : i % 4 == 2 ? 0.3 : 1;
    const Vec3 slope{uniform(random), i % 3 == 0 ? 1e-6 * uniform(random) : uniform(random),
                     i % 5 == 0   ? 0
                     : i % 7 == 0 ? 1e-3 * uniform(random)
                                  : uniform(random)};
    for (std::size_t k = 0; k < 8; ++k)
      corners[k] = ((k & 1) != 0 ? slope[0] : 0) + ((k & 2) != 0 ? slope[1] : 0) +
                   ((k & 4) != 0 ? slope[2] : 0) + bend * uniform(random);
    const double t = corners[0] + uniform(random) * 0.7;
    const auto f = [&](const TruthBox& b) {
      Interval r{infinity, -infinity};
      for (std::size_t k = 0; k < 8; ++k) {
        const Vec3 p{(k & 1) != 0 ? b.high[0] : b.low[0], (k & 2) != 0 ? b.high[1] : b.low[1],
                     (k & 4) != 0 ? b.high[2] : b.low[2]};
        double v = 0;
        for (std::size_t j = 0; j < 8; ++j)
          v += corners[j] * ((j & 1) != 0 ? p[0] : 1 - p[0]) * ((j & 2) != 0 ? p[1] : 1 - p[1]) *
               ((j & 4) != 0 ? p[2] : 1 - p[2]);
        r = {std::min(r.lo, v), std::max(r.hi, v)};
      }
      return r;
    };
    const Interval truth = reference::truth_volume(
        {{{0, 0, 0}, {1, 1, 1}}}, f, [](const TruthBox&) { return 1; }, t, infinity, 6);
    const Interval share = share_above(affine_of(corners), t);
    BOOST_TEST(overlap(share, truth));
    BOOST_TEST((share.lo >= 0 && share.hi <= 1 && share.lo <= share.hi));
    if (bend == 0) {
      ++sharp;
      // Slopes dropped as flat are below 1e-4 of all, each way; of the closed form 1e-10 is charged.
      BOOST_TEST(share.width() <= 4e-4 * 2);
    }
  }
  BOOST_TEST(sharp == 100);
}

BOOST_AUTO_TEST_CASE(volumes_and_fractions_of_analytic_fields_lie_in_their_intervals) {
  const unsigned fields = support::measured_fields(8);
  unsigned tried = 0, open = 0, fine = 0;
  for (unsigned seed = 0; seed < fields; ++seed) {
    MeasuredCase c = support::measured_case(seed);
    const support::MeasuredPlace where = support::measured_place(c, seed);
    const Measurement measurement(c.volume, c.certificate, where.region);
    const std::vector<TruthBox> bricks = c.bricks();
    const Interval all =
        reference::truth_volume(bricks, range_of(c), where.place, -infinity, infinity, depth);
    for (int kind = 0; kind < 3; ++kind) {
      const double a = value_in(c, -0.8, 0.8), b = a + value_in(c, 0.1, 1);
      ValueRange range;
      if (kind != 1) range.least = a;
      if (kind != 0) range.largest = b;
      const VolumeMeasure m = measurement.volume(range);
      const Interval truth =
          reference::truth_volume(bricks, range_of(c), where.place, range.least.value_or(-infinity),
                                  range.largest.value_or(infinity), depth);
      BOOST_TEST(overlap(m.volume, truth), "field " << seed << ": " << m.volume.lo << " to " << m.volume.hi
                                                    << ", truth " << truth.lo << " to " << truth.hi);
      BOOST_TEST(overlap(m.region, all));
      // No fraction is above 1, which sums of truth may exceed by rounding.
      BOOST_TEST(overlap(m.fraction, Interval{std::min(1.0, truth.lo / all.hi), truth.hi / all.lo}),
                 "field " << seed << ", range " << kind << ": " << m.fraction.lo << " to " << m.fraction.hi
                          << ", truth " << truth.lo << " to " << truth.hi << " of " << all.lo << " to "
                          << all.hi);
      BOOST_TEST(m.region.width() <= 1e-3 * m.region.hi * (1 + 0x1p-20));
      // Of the volume a tenth of what the bound leaves open, or a thousandth: open <= width - undecided.
      if (m.undecided <= std::max(1e-3 * m.volume.hi, 0.1 * (m.volume.width() - m.undecided)) + 1e-9) ++fine;
      BOOST_TEST((m.volume.lo >= 0 && m.volume.hi <= m.region.hi && m.fraction.hi <= 1));
      ++tried;
      if (m.volume.width() > 0) ++open;
    }
  }
  BOOST_TEST(tried == 3 * fields);
  BOOST_TEST(open > tried / 2);
  // Halving ends after four rounds: a few of thousands of ranges on these coarse grids need more.
  BOOST_TEST(fine >= tried - tried / 100);
}

BOOST_AUTO_TEST_CASE(round_regions_have_their_volume) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const MeasuredCase c = support::measured_case(seed);
    const double pi = std::acos(-1.0);
    const Interval ball = Measurement(c.volume, c.certificate, {{}, {{{0.1, -0.1, 0.2}, 2, false}}, {}})
                              .volume({0.0, {}})
                              .region;
    BOOST_TEST((ball.lo <= 32 * pi / 3 && 32 * pi / 3 <= ball.hi));
    const MeasureRegion upright{
        std::array<double, 6>{-9, -9, -1.2, 9, 9, 0.9}, {{{0.1, -0.1, 0}, 2, true}}, {}};
    const Interval cylinder = Measurement(c.volume, c.certificate, upright).mean().region;
    BOOST_TEST((cylinder.lo <= 2.1 * 4 * pi && 2.1 * 4 * pi <= cylinder.hi));
  }
}

BOOST_AUTO_TEST_CASE(an_adversary_within_the_bound_reaches_nine_tenths_of_the_volume_intervals) {
  for (unsigned seed = 0; seed < 2; ++seed) {
    MeasuredCase c = support::measured_case(seed);
    const std::vector<TruthBox> cells = cells_of(c);
    const reference::PlaceOf everywhere = [](const TruthBox&) { return 1; };
    const double value = value_in(c, -0.3, 0.3);
    const VolumeMeasure m = Measurement(c.volume, c.certificate).volume({value, {}});
    const Interval most = reference::truth_volume(cells, adversary(c, 1), everywhere, value, infinity, 3),
                   least = reference::truth_volume(cells, adversary(c, -1), everywhere, value, infinity, 3);
    BOOST_TEST(m.volume.hi >= most.lo);
    BOOST_TEST(m.volume.lo <= least.hi);
    // The mean of a trilinear function is its value in the middle; e adds its own.
    double v = 0, e = 0;
    for (const TruthBox& cell : cells) {
      const Interval up = adversary(c, 1)(middle_of(cell)), down = adversary(c, -1)(middle_of(cell));
      v += 0.5 * (up.lo + down.lo) * cell.volume();
      e += 0.5 * (up.lo - down.lo) * cell.volume();
    }
    const Interval mass = Measurement(c.volume, c.certificate).mean().integral;
    const double lost = tolerance::fp64_sum(static_cast<std::int64_t>(cells.size()), std::abs(v) + e);
    BOOST_TEST((mass.hi >= v + e - lost && mass.lo <= v - e + lost));
    BOOST_TEST(mass.width() <= 2 * e * 1.001);
    // The larger end of what brute force leaves open is what the adversary surely reaches, from inside.
    BOOST_TEST(
        (most.middle() - least.middle()) >= 0.9 * m.volume.width(),
        m.volume.lo << " to " << m.volume.hi << ", reached " << least.middle() << " to " << most.middle());
  }
}

BOOST_AUTO_TEST_CASE(intervals_shrink_in_proportion_to_the_bound) {
  MeasuredCase c = support::measured_case(1);
  const double value = 0.1;
  std::vector<double> widths;
  for (const float scale : {1.0f, 0.5f, 0.25f}) {
    Certificate scaled = c.certificate;
    for (float& e : scaled.brick_totals) e *= scale;
    widths.push_back(Measurement(c.volume, scaled).volume({value, {}}).volume.width());
  }
  // A surface that moves by half as much; its curvature is second order, geometry a twentieth.
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    BOOST_TEST(widths[i + 1] < 0.6 * widths[i]);
    BOOST_TEST(widths[i + 1] > 0.4 * widths[i]);
  }
}

BOOST_AUTO_TEST_CASE(means_and_integrals_lie_in_their_intervals) {
  const unsigned fields = support::measured_fields(8);
  for (unsigned seed = 0; seed < fields; ++seed) {
    MeasuredCase c = support::measured_case(seed);
    // In closed form: a box, which cuts cells.
    MeasureRegion region;
    TruthBox box;
    const Grid& g = c.volume.grid;
    for (std::size_t a = 0; a < 3; ++a) {
      const double side = static_cast<double>(g.cells[a]) * g.spacing[a];
      box.low[a] = g.origin[a] + value_in(c, 0.03, 0.4) * side;
      box.high[a] = g.origin[a] + value_in(c, 0.5, 0.97) * side;
    }
    region.box = {box.low[0], box.low[1], box.low[2], box.high[0], box.high[1], box.high[2]};
    const MeanMeasure m = Measurement(c.volume, c.certificate, region).mean();
    const double truth = c.field.integral(box);
    BOOST_TEST((m.integral.lo <= truth && truth <= m.integral.hi));
    BOOST_TEST((m.mean.lo <= truth / box.volume() && truth / box.volume() <= m.mean.hi));
    BOOST_TEST((m.region.lo <= box.volume() && box.volume() <= m.region.hi));
    // A twentieth of the bound is what halving of cut cells leaves open, of which there are none.
    BOOST_TEST(m.mean.width() <= 2.1 * m.bound);

    // Any region: the integral is that of its volumes {F >= t} over t, here as sums over small boxes.
    const support::MeasuredPlace where = support::measured_place(c, seed);
    double lo = 0, hi = 0;
    for (const TruthBox& brick : c.bricks())
      for (const TruthBox& part : parts_of(brick, {16, 16, 16})) {
        const int in = where.place(part);
        if (in < 0) continue;
        const Interval range = c.field.range(part);
        const double exact = c.field.integral(part);
        lo += in > 0 ? exact : std::min(0.0, range.lo * part.volume());
        hi += in > 0 ? exact : std::max(0.0, range.hi * part.volume());
      }
    const MeanMeasure w = Measurement(c.volume, c.certificate, where.region).mean();
    BOOST_TEST(overlap(w.integral, Interval{lo, hi}));
    BOOST_TEST((w.mean.lo * (w.mean.lo < 0 ? w.region.hi : w.region.lo) <= hi + 1e-9));
  }
}

BOOST_AUTO_TEST_CASE(extremes_lie_in_their_intervals) {
  const unsigned fields = support::measured_fields(8);
  for (unsigned seed = 0; seed < fields; ++seed) {
    MeasuredCase c = support::measured_case(seed);
    const support::MeasuredPlace where = support::measured_place(c, seed);
    const ExtremesMeasure m = Measurement(c.volume, c.certificate, where.region).extremes();
    Interval least{infinity, infinity}, largest{-infinity, -infinity};
    for (const TruthBox& brick : c.bricks())
      for (const TruthBox& part : parts_of(brick, {16, 16, 16})) {
        const int in = where.place(part);
        if (in < 0) continue;
        const Interval range = c.field.range(part);
        least.lo = std::min(least.lo, range.lo);
        largest.hi = std::max(largest.hi, range.hi);
        if (in == 0) continue;
        const double middle = c.field({0.5 * (part.low[0] + part.high[0]), 0.5 * (part.low[1] + part.high[1]),
                                       0.5 * (part.low[2] + part.high[2])});
        least.hi = std::min(least.hi, middle);
        largest.lo = std::max(largest.lo, middle);
      }
    BOOST_TEST(overlap(m.least, least));
    BOOST_TEST(overlap(m.largest, largest));
    BOOST_TEST(m.least.lo <= least.hi);
    BOOST_TEST(m.largest.hi >= largest.lo);
  }
}

BOOST_AUTO_TEST_CASE(a_distribution_holds_the_volumes_of_all_its_edges_and_bins) {
  const unsigned fields = support::measured_fields(4);
  for (unsigned seed = 0; seed < fields; ++seed) {
    MeasuredCase c = support::measured_case(seed);
    const support::MeasuredPlace where = support::measured_place(c, seed);
    std::vector<double> edges;
    for (int i = 0; i <= 9; ++i) edges.push_back(-1.8 + 0.4 * i);
    const Distribution d = Measurement(c.volume, c.certificate, where.region).distribution(edges);
    const std::vector<TruthBox> bricks = c.bricks();
    for (std::size_t k = 0; k < edges.size(); ++k) {
      BOOST_TEST(overlap(d.at_least[k], reference::truth_volume(bricks, range_of(c), where.place, edges[k],
                                                                infinity, depth)));
      if (k > 0) {
        BOOST_TEST(overlap(d.within[k - 1], reference::truth_volume(bricks, range_of(c), where.place,
                                                                    edges[k - 1], edges[k], depth)));
        BOOST_TEST(d.at_least[k].hi <= d.at_least[k - 1].hi);
        BOOST_TEST(d.at_least[k].lo <= d.at_least[k - 1].lo);
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(crossings_and_widths_along_lines_hold_those_of_the_field) {
  const unsigned fields = support::measured_fields(40);
  unsigned crossings = 0, widths = 0;
  for (unsigned seed = 0; seed < fields; ++seed) {
    MeasuredCase c = support::measured_case(seed, 2);
    const Measurement measurement(c.volume, c.certificate);
    // No grid reaches less far than 2.5 from 0.
    const Vec3 p{value_in(c, -2.4, -1.5), value_in(c, -2.4, 2.4), value_in(c, -2.4, 2.4)},
        q{value_in(c, 1.5, 2.4), value_in(c, -2.4, 2.4), value_in(c, -2.4, 2.4)};
    const double value = value_in(c, -0.1, 0.1);
    const LineMeasure m = measurement.along(p, q, {101, value});
    const auto f = [&](double t) {
      Vec3 x{};
      for (std::size_t a = 0; a < 3; ++a) x[a] = p[a] + t / m.length * (q[a] - p[a]);
      return c.field(x);
    };
    BOOST_TEST(m.at.size() == 101u);
    for (std::size_t i = 0; i < m.at.size(); ++i)
      BOOST_TEST((m.value[i].lo <= f(m.at[i]) && f(m.at[i]) <= m.value[i].hi));
    // F's own roots, by signs on 2^15 places: the waves have no two between neighbours.
    std::vector<double> roots;
    const int n = 1 << 15;
    for (int i = 0; i < n; ++i) {
      const double s = m.length * i / n, t = m.length * (i + 1) / n;
      if ((f(s) < value) != (f(t) < value)) roots.push_back(0.5 * (s + t));
    }
    const double step = m.length / n;
    for (const LineCrossing& x : m.crossings) {
      ++crossings;
      int changes = 0;
      for (const double r : roots) changes += r >= x.at.lo - step && r <= x.at.hi + step;
      BOOST_TEST(changes % 2 == 1);
      BOOST_TEST((f(x.at.hi) > value) == x.rising);
      BOOST_TEST((f(x.at.lo) < value) == x.rising);
    }
    for (const LineRun& run : m.runs) {
      if (!run.width) continue;
      ++widths;
      // The stretch around what is surely on that side.
      const double middle = 0.5 * (run.from.hi + run.to.lo);
      double from = 0, to = m.length;
      for (const double r : roots) {
        if (r < middle) from = std::max(from, r);
        else to = std::min(to, r);
      }
      BOOST_TEST((f(middle) > value) == run.above);
      BOOST_TEST((run.width->lo <= to - from + 2 * step && to - from - 2 * step <= run.width->hi));
    }
  }
  BOOST_TEST(crossings >= fields / 4);
  BOOST_TEST(widths > 0u);
}

BOOST_AUTO_TEST_CASE(a_run_that_may_be_two_has_no_width) {
  // 1 - x^2 twice, with a dip between that the bound does not tell from the value.
  MeasuredCase c = support::measured_case(2);
  c.volume = support::sampled_mixed(c.volume.grid, 4, 8, {{0, 0, 0}}, 1, [&](double x, double, double) {
    return x < 2 ? 0.0 : x < 3 ? 1.0 : x < 4 ? 0.5 : x < 6 ? 1.0 : 0.0;
  });
  c.certificate.brick_totals.assign(static_cast<std::size_t>(c.volume.brick_count()), 0.1f);
  const Grid& g = c.volume.grid;
  const double y = g.origin[1] + g.spacing[1], z = g.origin[2] + g.spacing[2];
  const LineMeasure m = Measurement(c.volume, c.certificate)
                            .along({g.origin[0], y, z}, {g.origin[0] + 8 * g.spacing[0], y, z}, {9, 0.5});
  BOOST_TEST_REQUIRE(m.crossings.size() == 2u);
  BOOST_TEST_REQUIRE(m.runs.size() == 1u);
  BOOST_TEST(m.runs[0].above);
  BOOST_TEST(!m.runs[0].width.has_value());
}

BOOST_AUTO_TEST_CASE(what_cannot_be_measured_is_refused) {
  MeasuredCase c = support::measured_case(0);
  const auto refused = [&](const Certificate& certificate, const MeasureRegion& region, const char* word) {
    BOOST_CHECK_EXCEPTION(Measurement(c.volume, certificate, region), Error, [&](const Error& e) {
      return std::string(e.what()).find(word) != std::string::npos;
    });
  };
  Certificate windowed = c.certificate;
  windowed.window = {0, 1};
  refused(windowed, {}, "window");
  Certificate old = c.certificate;
  old.brick_totals.clear();
  refused(old, {}, "build it again");
  Certificate unknown = c.certificate;
  unknown.covered.reset();
  refused(unknown, {}, "covered");
  refused(c.certificate, {std::array<double, 6>{50, 50, 50, 60, 60, 60}, {}, {}}, "no volume");
  refused(c.certificate, {std::array<double, 6>{1, 0, 0, -1, 1, 1}, {}, {}}, "roi");
  refused(c.certificate, {{}, {RoundRegion{{0, 0, 0}, -1, false}}, {}}, "radius");
  refused(c.certificate, {{}, {RoundRegion{{90, 0, 0}, 1, false}}, {}}, "no volume");
  auto mask = std::make_shared<Volume>();
  mask->grid = c.volume.grid;
  mask->samples.assign(static_cast<std::size_t>(mask->grid.sample_count()), 0.0f);
  refused(c.certificate, {{}, {}, mask}, "mask");
  Certificate untested = c.certificate;
  untested.brick_totals[0] = -1;
  const Measurement measurement(c.volume, untested);
  BOOST_CHECK_THROW((void)measurement.mean(), FileError);
  const Measurement sound(c.volume, c.certificate);
  BOOST_CHECK_THROW((void)sound.volume({}), InputError);
  BOOST_CHECK_THROW((void)sound.volume({1.0, 0.0}), InputError);
  BOOST_CHECK_THROW((void)sound.volume({std::nan(""), {}}), InputError);
  BOOST_CHECK_THROW((void)sound.distribution({1, 0}), InputError);
  BOOST_CHECK_THROW((void)sound.along({0, 0, 0}, {0, 0, 0}, {}), InputError);
  BOOST_CHECK_THROW((void)sound.along({0, 0, 90}, {0, 0, 95}, {}), InputError);
}
