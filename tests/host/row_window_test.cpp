#define BOOST_TEST_MODULE row_window
#include "host/scan/row_window.hpp"

#include <boost/test/unit_test.hpp>

#include "host/field/fbp/reconstruct.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/expert/reconstruct.hpp"

using namespace vdvr;

namespace {

ProjectionSet scan_of(std::int64_t rows, double pitch_v) {
  ProjectionSet scan = vdvr::testing::noise_scan(5, rows, 24);
  scan.geometry.pitch_v = pitch_v;
  return scan;
}

}  // namespace

BOOST_AUTO_TEST_CASE(nothing_where_all_rows_fit) {
  const ProjectionSet scan = scan_of(30, 1);
  const Grid grid = make_grid(scan.geometry, {});
  BOOST_TEST(!row_window(scan, grid, scan.size()).has_value());
  BOOST_TEST(row_window(scan, grid, scan.size() - 1).has_value());
}

// A node of the window's grid lies on the same detector row, with the same samples, as in the whole.
BOOST_AUTO_TEST_CASE(nodes_lie_where_they_lay) {
  for (const auto& [rows, pitch, spacing] :
       {std::tuple<int, double, double>{64, 1, 1}, {65, 0.5, 0.3}, {101, 2, 5}, {40, 1, 0.25}}) {
    const ProjectionSet scan = scan_of(rows, pitch);
    GridOptions options;
    options.spacing = 1;
    options.spacing_z = spacing;
    const Grid grid = make_grid(scan.geometry, options);
    const auto window = row_window(scan, grid, 5 * 24 * 27);
    BOOST_REQUIRE(window.has_value());
    BOOST_TEST(window->rows == 27);
    BOOST_TEST(window->scan.geometry.rows == 27);
    BOOST_TEST(window->scan.data.size() == 5u * 27 * 24);
    const auto row = [](const ParallelGeometry& g, const Grid& of, std::int64_t k) {
      return detector_rows(g, of.origin[2] + static_cast<double>(k) * of.spacing[2], 0, 1).front();
    };
    // Nodes of both grids follow one another at the same spacing: their first rows say where.
    const double first = row(window->scan.geometry, window->grid, 0) + static_cast<double>(window->first);
    const double steps = (first - row(scan.geometry, grid, 0)) * pitch / spacing;
    BOOST_TEST(std::abs(steps - std::round(steps)) < 1e-9);
    BOOST_TEST(row(window->scan.geometry, window->grid, 0) >= -1e-9);
    BOOST_TEST(row(window->scan.geometry, window->grid, window->grid.cells[2]) <= 26 + 1e-9);
    bool same = true;
    for (std::int64_t k = 0; k < 5; ++k)
      for (std::int64_t v = 0; v < 27; ++v)
        for (std::int64_t u = 0; u < 24; ++u)
          same = same && window->scan.data[static_cast<std::size_t>((k * 27 + v) * 24 + u)] ==
                             scan.data[static_cast<std::size_t>((k * rows + window->first + v) * 24 + u)];
    BOOST_TEST(same);
  }
}

BOOST_AUTO_TEST_CASE(rows_that_are_alike_are_taken_around_the_middle_of_the_grid) {
  ProjectionSet scan = scan_of(100, 1);
  for (std::int64_t i = 0; i < scan.size(); ++i)
    scan.data[static_cast<std::size_t>(i)] = static_cast<float>(i % 24 % 2);
  GridOptions options;
  options.size = Index3{8, 8, 8};
  for (const auto& [z, first] : {std::pair{-4.0, 37}, {20.0, 61}, {-49.0, 0}, {41.0, 73}}) {
    options.origin = Vec3{-4, -4, z};
    const auto window = row_window(scan, make_grid(scan.geometry, options), 5 * 24 * 27);
    BOOST_REQUIRE(window.has_value());
    BOOST_TEST(window->first == first);
  }
}

// An object whose upper part alone has structure, as far as the row that ends it, which is the steepest.
BOOST_AUTO_TEST_CASE(as_much_goes_on_in_the_rows_as_in_all) {
  for (const std::int64_t busy : {20, 50, 80}) {
    ProjectionSet scan = scan_of(100, 1);
    for (std::int64_t i = 0; i < scan.size(); ++i) {
      const std::int64_t row = i / 24 % 100;
      scan.data[static_cast<std::size_t>(i)] =
          row < 100 - busy ? 1.0f : static_cast<float>((row == 99 ? 100 : 1) * (i % 24 % 2));
    }
    const auto window = row_window(scan, make_grid(scan.geometry, {}), 5 * 24 * 27);
    BOOST_REQUIRE(window.has_value());
    const auto in_it = static_cast<double>(
        std::max<std::int64_t>(0, window->first + 27 - std::max<std::int64_t>(window->first, 100 - busy)));
    // A row more or less is 1 / 27; the last counts as three, and those beside the step go for busy.
    BOOST_TEST(std::abs(in_it / 27 - static_cast<double>(busy) / 100) <= 0.02 + 1.0 / 27 + 3.0 / 100,
               busy << " rows: " << in_it);
  }
}

BOOST_AUTO_TEST_CASE(nothing_where_the_grid_lies_elsewhere) {
  const ProjectionSet scan = scan_of(100, 1);
  GridOptions options;
  options.size = Index3{8, 8, 8};
  options.origin = Vec3{-4, -4, 60};
  BOOST_TEST(!row_window(scan, make_grid(scan.geometry, options), 5 * 24 * 27).has_value());
}
