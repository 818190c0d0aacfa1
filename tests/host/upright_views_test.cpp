// Views of leaning detectors as upright ones have them: the same rays, columns along z, and rows of tables
// that read where the leaning detector has what they stand for.
#define BOOST_TEST_MODULE upright_views
#include "host/certify/kept/upright_views.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>

#include "host/scan/geometry/vectors.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using testing::ConeShape;

struct Views {
  std::vector<ViewMatrix> leaning;
  ParallelGeometry detector;
};

Views views_of(double in_plane_deg, double out_of_plane_deg) {
  const ConeShape shape{.views = 7,
                        .rows = 41,
                        .columns = 64,
                        .source_to_axis = 150,
                        .in_plane_deg = in_plane_deg,
                        .out_of_plane_deg = out_of_plane_deg};
  const ConeGeometry cone = testing::cone_of(shape);
  return {cone.views, parallel_limit(cone, shape.columns, shape.rows, "pixel")};
}

const std::vector<Views>& all() {
  static const std::vector<Views> views{views_of(0.3, 0.4), views_of(-2, 0), views_of(0, 5),
                                        views_of(25, -20)};
  return views;
}

// Of a length of some hundred pixels.
const double close = tolerance::fp64_sum(1e4, 1);

BOOST_AUTO_TEST_CASE(columns_of_nodes_lie_in_columns_at_one_lambda) {
  for (const Views& of : all()) {
    const UprightViews upright(of.leaning, of.detector);
    for (const ViewMatrix& m : upright.views()) {
      BOOST_TEST(is_upright(m));
      const Vec3 low = projected(m, {3, -5, -12}), high = projected(m, {3, -5, 17});
      BOOST_TEST(low[0] == high[0]);
      BOOST_TEST(low[2] == high[2]);
      BOOST_TEST(std::abs(high[1] - low[1]) > 20);
    }
  }
}

// A row of a table stands for the leaning detector's values times the square of lambda over lambda, which is
// what F asks for; at every column.
BOOST_AUTO_TEST_CASE(rows_read_where_the_leaning_detector_sees_the_same_ray) {
  std::mt19937 random(3);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  for (const Views& of : all()) {
    UprightViews upright(of.leaning, of.detector);
    upright.set_table(6, {1, 1}, {-3, -3}, {70, 50});
    const UpsampledColumns columns = upsampled_columns(of.detector.columns, 6, 3),
                           rows = upsampled_columns(of.detector.rows, 6, 3);
    int looked_at = 0;
    for (std::size_t k = 0; k < of.leaning.size(); ++k) {
      const auto table = upright.rows_of<double>(k, columns, rows);
      BOOST_TEST(std::ssize(table) == upright.rows().count);
      for (int i = 0; i < 200; ++i) {
        const Vec3 p{between(-20, 20), between(-20, 20), between(-14, 14)};
        const Vec3 wanted = projected(of.leaning[k], p), seen = projected(upright.views()[k], p);
        if (!(wanted[1] > 0 && wanted[1] < 40)) continue;
        // Between two rows of the table places and weights follow those of either.
        const double at = upright.rows().column_of(seen[1]), column = upright.columns().column_of(seen[0]);
        const auto below = static_cast<std::size_t>(at);
        const double share = at - std::floor(at);
        const auto place = [&](const UprightRow<double>& r) {
          return std::array{r.column + 3 + r.part_u + (1 + r.grow_u) * column + 0.5,
                            r.row + 3 + r.part_v + 0.5, 1 / std::sqrt(r.weight)};
        };
        const auto low = place(table[below]), high = place(table[below + 1]);
        // 1 / scale is linear in the row, and so are places times it.
        const double scale = low[2] + share * (high[2] - low[2]);
        const auto mixed = [&](std::size_t a, double middle) {
          return middle +
                 ((low[a] - middle) * low[2] * (1 - share) + (high[a] - middle) * high[2] * share) / scale;
        };
        const double u = mixed(0, columns.column_of(0.5 * 63)), v = mixed(1, rows.column_of(0.5 * 40));
        BOOST_TEST(std::abs(u - columns.column_of(wanted[0])) <= close);
        BOOST_TEST(std::abs(v - rows.column_of(wanted[1])) <= close);
        BOOST_TEST(std::abs(wanted[2] - seen[2] * scale) <= close);
        ++looked_at;
      }
    }
    BOOST_TEST(looked_at > 500);
  }
}

// Eight taps want no more than `entries` a pixel of the leaning detector, wherever it is looked at.
BOOST_AUTO_TEST_CASE(tables_are_as_dense_as_what_they_are_made_of) {
  for (const Views& of : all()) {
    UprightViews upright(of.leaning, of.detector);
    upright.set_table(6, {1, 1}, {-3, -3}, {70, 50});
    for (std::size_t k = 0; k < of.leaning.size(); ++k)
      for (const Vec3& p : {Vec3{0, 0, 0}, Vec3{-18, 5, 12}, Vec3{10, 17, -13}}) {
        // Moves by an entry along u and along v, on the plane of the upright detector through p.
        const ViewMatrix &m = of.leaning[k], &own = upright.views()[k];
        const Vec3 here = projected(m, p), there = projected(own, p);
        const auto row = [&](std::size_t i) { return Vec3{own[i][0], own[i][1], own[i][2]}; };
        const double volume = dot(row(0), cross(row(1), row(2)));
        for (const bool along_v : {false, true}) {
          const Vec3 step = along_v ? cross(row(2), row(0)) : cross(row(1), row(2));
          Vec3 q = p;
          for (std::size_t a = 0; a < 3; ++a) q[a] += 1e-4 * step[a] / volume;
          const Vec3 moved = projected(m, q), own_moved = projected(own, q);
          const double entries = along_v ? (own_moved[1] - there[1]) * upright.rows().density
                                         : (own_moved[0] - there[0]) * upright.columns().density;
          const double pixels = std::abs(moved[0] - here[0]) + std::abs(moved[1] - here[1]);
          BOOST_TEST(6 * pixels <= std::abs(entries) * (1 + 1e-6));  // a step of 1e-4: its square is left out
        }
      }
  }
}

BOOST_AUTO_TEST_CASE(columns_that_lie_across_the_axis_are_refused_by_view) {
  const Views of = views_of(80, 0);
  BOOST_CHECK_EXCEPTION(UprightViews(of.leaning, of.detector), InputError, [](const InputError& e) {
    return std::string(e.what()).find("columns of view 0 lean") != std::string::npos;
  });
}

}  // namespace
}  // namespace vdvr
