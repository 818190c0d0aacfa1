#define BOOST_TEST_MODULE prepare
#include "host/scan/prepare/prepare.hpp"

#include <boost/test/unit_test.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/scan/prepare/preparation_json.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/preparation.hpp"
#include "vdvr/read_scan.hpp"

using namespace vdvr;
using namespace vdvr::testing;
using vdvr::support::TemporaryFolder;

namespace {

View view_of(std::int64_t columns, std::int64_t rows,
             const std::function<double(std::int64_t, std::int64_t)>& p) {
  View view{columns, rows, std::vector<double>(static_cast<std::size_t>(columns * rows))};
  for (std::int64_t j = 0; j < rows; ++j)
    for (std::int64_t i = 0; i < columns; ++i) view.at(i, j) = p(i, j);
  return view;
}

Preparation binning_by(int factor) {
  Preparation p;
  p.binning = factor;
  return p;
}

ProjectionSet read(const std::filesystem::path& path, const Preparation& preparation) {
  ScanOptions options;
  options.preparation = preparation;
  return read_scan(path, options);
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_bright_pixel_becomes_its_neighbours_median_and_nothing_else_changes) {
  const auto plain = [](std::int64_t i, std::int64_t j) {
    return 1 + 0.01 * static_cast<double>(i) + 0.02 * static_cast<double>(j);
  };
  const View clean = view_of(9, 7, plain);
  View view = clean;
  view.at(4, 3) = -0.5;  // brighter than the open beam
  BOOST_TEST(remove_outliers(view, {0.1, 3}) == 1);
  // Of the eight neighbours and the pixel, lowest of all, the median is the fourth of the eight.
  std::vector<double> around;
  for (std::int64_t j = 2; j <= 4; ++j)
    for (std::int64_t i = 3; i <= 5; ++i)
      if (i != 4 || j != 3) around.push_back(clean.at(i, j));
  std::sort(around.begin(), around.end());
  for (std::int64_t j = 0; j < 7; ++j)
    for (std::int64_t i = 0; i < 9; ++i)
      BOOST_TEST(view.at(i, j) == (i == 4 && j == 3 ? around[3] : clean.at(i, j)));
}

BOOST_AUTO_TEST_CASE(a_dark_pixel_is_no_outlier) {
  View view = view_of(5, 5, [](auto...) { return 1.0; });
  view.at(2, 2) = 4;
  BOOST_TEST(remove_outliers(view, {0.1, 3}) == 0);
}

// Mirrored, a cosine that ends at the outer sides of the outer pixels goes on as itself.
BOOST_AUTO_TEST_CASE(phase_retrieval_divides_each_frequency_of_the_transmission) {
  constexpr std::int64_t columns = 32, rows = 16;
  constexpr double pitch_u = 0.5, pitch_v = 0.25, area = 0.7, mean = 0.5, height = 0.2;
  for (const auto& [m, n] : {std::pair<int, int>{0, 0}, {3, 0}, {0, 5}, {7, 2}, {31, 15}}) {
    const auto wave = [m = m, n = n](std::int64_t i, std::int64_t j) {
      return std::cos(std::numbers::pi * m * (static_cast<double>(i) + 0.5) / columns) *
             std::cos(std::numbers::pi * n * (static_cast<double>(j) + 0.5) / rows);
    };
    View view = view_of(columns, rows, [&](auto i, auto j) { return -std::log(mean + height * wave(i, j)); });
    PaganinFilter(columns, rows, pitch_u, pitch_v, area).apply(view);
    const double ku = std::numbers::pi * m / (columns * pitch_u),
                 kv = std::numbers::pi * n / (rows * pitch_v);
    const double passed = 1 / (1 + area * (ku * ku + kv * kv));
    double worst = 0;
    for (std::int64_t j = 0; j < rows; ++j)
      for (std::int64_t i = 0; i < columns; ++i)
        worst = std::max(worst, std::abs(view.at(i, j) + std::log(mean + height * passed * wave(i, j))));
    // log, exp, four FFTs of 6 and 5 steps: of values up to 1, divided by the least transmission.
    BOOST_TEST(worst <= tolerance::fp64_sum(64 * 32, 1 / (mean - height)));
  }
}

// d lambda (delta / beta) / (4 pi): 50 mm, 20 keV (0.0619920990 nm), 1000.
BOOST_AUTO_TEST_CASE(phase_retrieval_counts_in_millimetres_and_kiloelectronvolts) {
  const double expected = 50 * 0.0619920990e-6 * 1000 / (4 * std::numbers::pi);
  BOOST_TEST(std::abs(paganin_area_mm2({50, 20, 1000}) - expected) <=
             1e-9 * expected);  // digits of the literal
  BOOST_TEST(millimetres_of("um") == 1e-3);
  BOOST_CHECK_THROW(static_cast<void>(millimetres_of("pixel")), InputError);
}

BOOST_AUTO_TEST_CASE(binning_keeps_the_mean_and_moves_the_axis_with_its_pixels) {
  const TemporaryFolder folder;
  ProjectionSet scan = noise_scan(5, 7, 13);
  scan.geometry.center = 6.25;
  scan.geometry.pitch_u = 0.5, scan.geometry.pitch_v = 0.25;
  write_data_exchange(folder / "scan.h5", scan);
  const ProjectionSet binned = read(folder / "scan.h5", binning_by(3));
  const ParallelGeometry& g = binned.geometry;
  BOOST_TEST(g.columns == 4);
  BOOST_TEST(g.rows == 2);
  BOOST_TEST(g.pitch_u == 1.5);
  BOOST_TEST(g.pitch_v == 0.75);
  BOOST_TEST(g.center == (6.25 - 1) / 3);
  double sum = 0;
  for (std::int64_t j = 3; j < 6; ++j)
    for (std::int64_t i = 6; i < 9; ++i)
      sum += static_cast<double>(scan.data[static_cast<std::size_t>((2 * 7 + j) * 13 + i)]);
  BOOST_TEST(binned.data[static_cast<std::size_t>((2 * 2 + 1) * 4 + 2)] == static_cast<float>(sum / 9));
  BOOST_TEST((binned.report.preparation == binning_by(3)));
}

BOOST_AUTO_TEST_CASE(binned_cone_beam_sees_each_point_where_the_binned_pixel_is) {
  SimulateOptions options;
  options.columns = 32, options.rows = 24, options.angles = 12;
  options.cone = ConeSetup{200, 300};
  options.cone->in_plane_deg = 3;
  ProjectionSet scan = simulate(sphere(4), options);
  const std::vector<ViewMatrix> before = scan.cone->views;
  prepare_scan(scan, binning_by(4), 0, {});
  BOOST_TEST(scan.geometry.columns == 8);
  const Vec3 point{3, -5, 2};
  for (std::size_t k = 0; k < before.size(); ++k) {
    const auto seen = [&](const ViewMatrix& m, std::size_t axis) {
      const auto row = [&](std::size_t i) {
        return m[i][0] * point[0] + m[i][1] * point[1] + m[i][2] * point[2] + m[i][3];
      };
      return row(axis) / row(2);
    };
    for (const std::size_t axis : {0u, 1u})
      BOOST_TEST(std::abs(seen(scan.cone->views[k], axis) - (seen(before[k], axis) - 1.5) / 4) <=
                 tolerance::fp64_sum(16, 32));
  }
}

BOOST_AUTO_TEST_CASE(a_prepared_scan_is_that_of_its_steps_in_order) {
  const TemporaryFolder folder;
  const ProjectionSet scan = noise_scan(9, 6, 20);
  write_data_exchange(folder / "scan.h5", scan);
  Preparation p = binning_by(2);
  p.median = 3;
  p.gaussian = {0.8, 0.5};
  const ProjectionSet prepared = read(folder / "scan.h5", p);
  for (std::int64_t k = 0; k < 9; ++k) {
    const float* from = scan.data.data() + k * 6 * 20;
    const View view =
        binned(gaussian_filtered(median_filtered({20, 6, {from, from + 6 * 20}}, 3), 0.8, 0.5), 2);
    for (std::size_t i = 0; i < view.data.size(); ++i)
      BOOST_TEST(prepared.data[static_cast<std::size_t>(k) * view.data.size() + i] ==
                 static_cast<float>(view.data[i]));
  }
}

BOOST_AUTO_TEST_CASE(json_of_a_preparation_gives_it_back_and_strangers_are_refused) {
  Preparation p = binning_by(2);
  p.outliers = Outliers{0.07, 5};
  p.phase = PhaseRetrieval{12.5, 30, 250};
  p.stripes = Stripes{2.5, 61, 31};
  p.median = 3;
  p.gaussian = {0.1, 4};
  BOOST_TEST((preparation_of(json_of(p)) == p));
  BOOST_TEST(text_of(p) ==
             "outliers 0.07,5; phase 12.5,30,250; stripes 2.5,61,31; median 3; gaussian 0.1,4; binning 2");
  BOOST_TEST((preparation_of(nlohmann::json::object()).none()));
  for (const char* wrong :
       {R"({"sharpen": 1})", R"({"binning": 0})", R"({"binning": 2.5})", R"({"median": 4})",
        R"({"gaussian": [1]})", R"({"stripes": {"ratio": 3, "large": 51}})",
        R"({"stripes": {"ratio": -1, "large": 51, "small": 21}})", R"({"outliers": 1})",
        R"({"phase": {"distance_mm": 0, "energy_kev": 1, "delta_beta": 1}})", "[1]"})
    BOOST_CHECK_THROW(static_cast<void>(preparation_of(nlohmann::json::parse(wrong))), InputError);
}

BOOST_AUTO_TEST_CASE(windows_of_stripes_follow_the_detector_and_are_recorded) {
  const TemporaryFolder folder;
  write_data_exchange(folder / "scan.h5", noise_scan(9, 2, 129));
  Preparation p;
  p.stripes.emplace();
  BOOST_TEST(text_of(read(folder / "scan.h5", p).report.preparation) == "stripes 3,21,7");
  BOOST_TEST(text_of(for_columns(p, 2560)) == "stripes 3,51,21");
  BOOST_TEST(text_of(for_columns(p, 4)) == "stripes 3,5,5");
}

BOOST_AUTO_TEST_CASE(phase_retrieval_of_cone_beam_and_of_nameless_units_is_refused) {
  Preparation p;
  p.phase = PhaseRetrieval{12.5, 30, 250};
  ParallelGeometry g = empty_scan(4, 4, 8).geometry;
  BOOST_CHECK_THROW(ViewPreparation(p, g, false), InputError);
  g.unit = "um";
  BOOST_CHECK_NO_THROW(ViewPreparation(p, g, false));
  BOOST_CHECK_THROW(ViewPreparation(p, g, true), InputError);
}

BOOST_AUTO_TEST_CASE(binning_that_leaves_no_pixel_is_refused) {
  ProjectionSet scan = noise_scan(3, 2, 8);
  BOOST_CHECK_THROW(prepare_scan(scan, binning_by(3), 0, {}), InputError);
}
