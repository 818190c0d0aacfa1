// Components of what is in a range, held to fields whose components are known, and to random fields whose
// parts a fine lattice joins. VDVR_MEASURE_FIELDS asks for more fields than the few of every run.
#define BOOST_TEST_MODULE components
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "tests/support/measured_fields.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/components.hpp"

using namespace vdvr;
using reference::TruthBox;
using support::MeasuredCase;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// cos(k x) cos(k y) cos(k z), the sum of four waves: above 0 it has a component around every point whose
/// coordinates are multiples of pi / k with an even sum, and planes where it is 0 between them.
MeasuredCase lattice_case(double k, const LevelTriple& coarsening, float scale) {
  MeasuredCase c;
  for (const double b : {-1.0, 1.0})
    for (const double d : {-1.0, 1.0})
      c.field.waves.push_back({0.25, std::numbers::pi / 2, {k, b * k, d * k}});
  Grid grid;
  grid.cells = {32, 32, 32};
  grid.origin = {-16, -16, -16};
  c.volume = support::sampled_mixed(
      grid, 4, 8, {{0, 0, 0}, {1, 1, 1}, {2, 1, 0}, {0, 2, 2}}, 5,
      [&](double x, double y, double z) {
        return c.field({x - 16, y - 16, z - 16});
      },
      coarsening);
  std::vector<float> totals;
  for (const LevelTriple& l : c.volume.level) {
    double e = 0x1p-22;
    for (std::size_t a = 0; a < 3; ++a)
      e += std::pow(std::ldexp(1.0, c.volume.coarsening[2 - a] - l[2 - a]), 2) / 8 * c.field.curvature(a);
    totals.push_back(scale * static_cast<float>(e));
  }
  c.certificate = support::bounds_certificate(std::move(totals), 100, -100, 100);
  return c;
}

class Lattice3 {
 public:
  /// Boxes of a third of a cell; `in` says which count, `corners` whether they join there, too.
  Lattice3(const Grid& grid, const std::function<bool(const TruthBox&)>& in, bool corners) : grid_(grid) {
    for (std::size_t a = 0; a < 3; ++a) n_[a] = fine * grid.cells[a];
    parent_.resize(static_cast<std::size_t>(n_[0] * n_[1] * n_[2]));
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    in_.resize(parent_.size());
    for (std::int64_t z = 0; z < n_[2]; ++z)
      for (std::int64_t y = 0; y < n_[1]; ++y)
        for (std::int64_t x = 0; x < n_[0]; ++x) {
          const std::size_t i = number({x, y, z});
          in_[i] = in(box({x, y, z})) ? 1 : 0;
          if (in_[i] == 0) continue;
          for (std::int64_t dz = -1; dz <= 0; ++dz)
            for (std::int64_t dy = -1; dy <= 1; ++dy)
              for (std::int64_t dx = -1; dx <= 1; ++dx) {
                const Index3 p{x + dx, y + dy, z + dz};
                if (!corners && std::abs(dx) + std::abs(dy) + std::abs(dz) != 1) continue;
                if (p[0] < 0 || p[1] < 0 || p[2] < 0 || p[0] >= n_[0] || p[1] >= n_[1]) continue;
                if (const std::size_t j = number(p); j < i && in_[j] != 0) parent_[root(j)] = root(i);
              }
        }
  }
  /// Of the box that holds a point; nothing where that does not count.
  [[nodiscard]] std::optional<std::size_t> component(const Vec3& p) {
    Index3 i{};
    for (std::size_t a = 0; a < 3; ++a)
      i[a] = static_cast<std::int64_t>(std::floor((p[a] - grid_.origin[a]) / grid_.spacing[a] * fine));
    const std::size_t k = number(i);
    return in_[k] != 0 ? std::optional(root(k)) : std::nullopt;
  }

 private:
  static constexpr std::int64_t fine = 3;
  [[nodiscard]] std::size_t number(const Index3& i) const {
    return static_cast<std::size_t>((i[2] * n_[1] + i[1]) * n_[0] + i[0]);
  }
  [[nodiscard]] TruthBox box(const Index3& i) const {
    TruthBox b;
    for (std::size_t a = 0; a < 3; ++a) {
      b.low[a] = grid_.origin[a] + static_cast<double>(i[a]) / fine * grid_.spacing[a];
      b.high[a] = grid_.origin[a] + static_cast<double>(i[a] + 1) / fine * grid_.spacing[a];
    }
    return b;
  }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  Grid grid_;
  Index3 n_{};
  std::vector<std::size_t> parent_;
  std::vector<std::uint8_t> in_;
};

}  // namespace

BOOST_AUTO_TEST_CASE(separate_blobs_are_counted_and_each_row_holds_its_volume) {
  constexpr double k = 0.45, half = std::numbers::pi / 2 / k;  // planes of 0 at odd multiples of half
  const MeasuredCase c = lattice_case(k, {}, 1);
  // Three by three by three places; 13 have an even sum: the middle, and 12 with two odd coordinates.
  MeasureRegion region;
  region.box = {-3 * half, -3 * half, -3 * half, 3 * half, 3 * half, 3 * half};
  const Measurement m(c.volume, c.certificate, region);
  constexpr std::int64_t blobs = 13, pores = 14;
  const double value = 0.6;
  const ComponentTable t = m.components({value, {}}, {});
  BOOST_TEST(t.certain == blobs);
  BOOST_TEST(t.possible == blobs);
  BOOST_TEST(t.sure_parts >= blobs);
  BOOST_TEST(t.rows.size() == static_cast<std::size_t>(blobs));
  const Interval one = reference::truth_volume(
      {{{-half, -half, -half}, {half, half, half}}}, [&](const TruthBox& b) { return c.field.range(b); },
      [](const TruthBox&) { return 1; }, value, infinity, 6);
  for (const MeasuredComponent& row : t.rows) {
    BOOST_TEST((row.volume.lo <= one.hi && row.volume.hi >= one.lo));
    BOOST_TEST((row.spans[0] == Answer::no && row.spans[1] == Answer::no && row.spans[2] == Answer::no));
    for (std::size_t a = 0; a < 3; ++a) BOOST_TEST(row.box[a + 3] - row.box[a] <= 2 * half);
  }
  // The volume of all is that of a measurement without components.
  const VolumeMeasure v = m.volume({value, {}});
  BOOST_TEST((t.volume.lo <= v.volume.hi && t.volume.hi >= v.volume.lo));
  BOOST_TEST(m.components({{}, -value}, {}).certain == pores);
  // Above less than 0 everything hangs together, by the planes of 0.
  const ComponentTable all = m.components({-0.5, {}}, {});
  BOOST_TEST(all.certain == 1);
  BOOST_TEST(all.possible == 1);
  BOOST_TEST((all.rows.at(0).spans[0] == Answer::yes && all.rows.at(0).spans[2] == Answer::yes));
}

BOOST_AUTO_TEST_CASE(no_more_components_are_certain_than_exist_whatever_the_base) {
  constexpr double k = 0.45, half = std::numbers::pi / 2 / k;
  MeasureRegion region;
  region.box = {-3 * half, -3 * half, -3 * half, 3 * half, 3 * half, 3 * half};
  for (const LevelTriple& coarsening : {LevelTriple{1, 0, 1}, LevelTriple{1, 1, 1}, LevelTriple{0, 2, 0}}) {
    const MeasuredCase c = lattice_case(k, coarsening, 1);
    const Measurement m(c.volume, c.certificate, region);
    for (const double value : {0.3, 0.5, 0.7}) {
      BOOST_TEST(m.components({value, {}}, {}).certain <= 13);
      BOOST_TEST(m.components({{}, -value}, {}).certain <= 14);
    }
    BOOST_TEST(m.components({-0.9, {}}, {}).certain == 1);
  }
}

BOOST_AUTO_TEST_CASE(what_the_bound_does_not_tell_is_neither_counted_nor_denied) {
  constexpr double k = 0.45, half = std::numbers::pi / 2 / k;
  MeasuredCase c = lattice_case(k, {}, 1);
  for (float& e : c.certificate.brick_totals) e = 0.45f;
  MeasureRegion region;
  region.box = {-3 * half, -3 * half, -3 * half, 3 * half, 3 * half, 3 * half};
  const Measurement m(c.volume, c.certificate, region);
  // Blobs above 0.3 may touch, since the field of 0 between them may be 0.45; each surely exists.
  ComponentsOptions options;
  options.points = {{0, 0, 0}, {2 * half, 2 * half, 0}, {half, half, half}, {2 * half, 0, 0}};
  const ComponentTable t = m.components({0.3, {}}, options);
  BOOST_TEST(t.certain == 1);
  BOOST_TEST(t.possible == 1);
  BOOST_TEST(t.sure_parts >= 13);
  BOOST_TEST((connected(t.points[0], t.points[0]) == Answer::yes));
  BOOST_TEST((connected(t.points[0], t.points[1]) == Answer::maybe));
  BOOST_TEST((t.points[2].within == Answer::maybe));
  BOOST_TEST((t.points[3].within == Answer::no));
  BOOST_TEST((connected(t.points[0], t.points[3]) == Answer::no));
  // Above 0.9 none is sure: V is nowhere above 1.
  const ComponentTable none = m.components({0.9, {}}, {});
  BOOST_TEST(none.certain == 0);
  BOOST_TEST(none.possible == 13);
  BOOST_TEST(none.volume.lo == 0);
  BOOST_TEST(none.uncertain_volume >= 13 * none.largest_uncertain * 0.5);
  ComponentsOptions large;
  large.least_volume = none.largest_uncertain * 2;
  const ComponentTable few = m.components({0.9, {}}, large);
  BOOST_TEST(few.rows.empty());
  BOOST_TEST(few.possible == 13);
}

BOOST_AUTO_TEST_CASE(sure_connections_and_separations_are_those_of_the_field) {
  const unsigned fields = support::measured_fields(12);
  int joined = 0, apart = 0;
  for (unsigned seed = 0; seed < fields; ++seed) {
    MeasuredCase c = support::measured_case(seed, 1.4);
    const support::MeasuredPlace where = support::measured_place(c, seed);
    const bool above = seed % 2 == 0;
    const double value = std::uniform_real_distribution<double>(0, 0.9)(c.random) * (above ? 1 : -1);
    const auto may = [&](const TruthBox& b) {
      if (where.place(b) < 0) return false;
      const Interval r = c.field.range(b);
      return above ? r.hi >= value : r.lo <= value;
    };
    const auto does = [&](const TruthBox& b) {
      if (where.place(b) <= 0) return false;
      const Interval r = c.field.range(b);
      return above ? r.lo >= value : r.hi <= value;
    };
    Lattice3 upper(c.volume.grid, may, true), lower(c.volume.grid, does, false);
    ComponentsOptions options;
    const Grid& g = c.volume.grid;
    for (int i = 0; i < 80; ++i) {
      Vec3 p{};
      for (std::size_t a = 0; a < 3; ++a)
        p[a] = g.origin[a] + std::uniform_real_distribution<double>(0, 0.999)(c.random) * g.spacing[a] *
                                 static_cast<double>(g.cells[a]);
      options.points.push_back(p);
    }
    ValueRange range;
    (above ? range.least : range.largest) = value;
    const ComponentTable t = Measurement(c.volume, c.certificate, where.region).components(range, options);
    for (std::size_t i = 0; i < options.points.size(); ++i) {
      const auto u = upper.component(options.points[i]), l = lower.component(options.points[i]);
      if (t.points[i].within == Answer::yes) BOOST_TEST(u.has_value());
      if (l) BOOST_TEST((t.points[i].within != Answer::no));
      for (std::size_t j = 0; j < i; ++j) {
        const Answer answer = connected(t.points[i], t.points[j]);
        if (answer == Answer::yes) {
          ++joined;
          BOOST_TEST((u && u == upper.component(options.points[j])),
                     "field " << seed << " joins what is apart");
        }
        if (l && l == lower.component(options.points[j])) BOOST_TEST((answer != Answer::no));
        if (answer == Answer::no && l && lower.component(options.points[j])) ++apart;
      }
    }
  }
  BOOST_TEST(joined > 0);
  BOOST_TEST(apart > 0);
}

BOOST_AUTO_TEST_CASE(what_connects_beyond_the_region_does_not_count) {
  // Two slabs that meet where the ball is not: F is above the value but for a wall between them.
  MeasuredCase c = lattice_case(0.45, {}, 1);
  c.volume = support::sampled_mixed(
      c.volume.grid, 4, 8, {{0, 0, 0}, {1, 1, 1}}, 3,
      [](double x, double, double z) { return std::abs(x - 16) < 1.5 && z < 24 ? 0.0 : 1.0; });
  c.certificate.brick_totals.assign(static_cast<std::size_t>(c.volume.brick_count()), 0.1f);
  ComponentsOptions options;
  options.points = {{-4, 0, 0}, {4, 0, 0}};
  const ComponentTable open = Measurement(c.volume, c.certificate).components({0.5, {}}, options);
  BOOST_TEST((connected(open.points[0], open.points[1]) == Answer::yes));
  const MeasureRegion ball{{}, {{{0, 0, 0}, 7, false}}, {}};
  const ComponentTable closed = Measurement(c.volume, c.certificate, ball).components({0.5, {}}, options);
  BOOST_TEST((connected(closed.points[0], closed.points[1]) == Answer::no));
  BOOST_TEST(closed.certain == 2);
}

BOOST_AUTO_TEST_CASE(a_table_that_needs_too_much_memory_is_refused) {
  const MeasuredCase c = lattice_case(0.45, {}, 1);
  ComponentsOptions options;
  options.max_memory_bytes = 1000;
  BOOST_CHECK_THROW((void)Measurement(c.volume, c.certificate).components({0.5, {}}, options), ResourceError);
}
