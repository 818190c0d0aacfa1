// Rows made longer: held to the reference and to verify's own; what is recorded, recognised and refused.
#define BOOST_TEST_MODULE extend_rows
#include "vdvr/expert/extend_rows.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "host/field/fbp/coverage.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "tests/reference/longer_rows.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/rows_to_verify.hpp"

using namespace vdvr;
using vdvr::testing::noise_scan;
using vdvr::testing::wanted;

namespace {

ProjectionSet turned(std::int64_t views, std::int64_t columns, double center, double arc = 360) {
  ProjectionSet scan = noise_scan(views, 2, columns, 7, arc);
  scan.geometry.center = center;
  return scan;
}

std::string refusal(ProjectionSet scan, const Preparation& p) {
  try {
    static_cast<void>(extend_rows(scan, p));
  } catch (const InputError& e) {
    return e.what();
  }
  return {};
}

struct Shape {
  std::int64_t columns;
  double center;
  bool half;
  Padding padding;
};

std::vector<Shape> shapes() {
  std::vector<Shape> all;
  for (const Padding padding : {Padding::none, Padding::edge, Padding::mirror})
    for (const bool half : {false, true})
      for (const auto& [columns, center] : {std::pair<std::int64_t, double>{40, 7.3},
                                            {41, 30.25},
                                            {40, 19.5},
                                            {33, 16.1},
                                            {64, 4.5},
                                            {64, 58.123456789}})
        if (half || padding != Padding::none) all.push_back({columns, center, half, padding});
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(rows_are_those_of_the_reference_to_three_roundings) {
  for (const Shape& s : shapes()) {
    const ProjectionSet own = turned(9, s.columns, s.center);
    ProjectionSet scan = own;
    static_cast<void>(extend_rows(scan, wanted(s.half, s.padding)));
    reference::LongerRows reference;
    const auto pad = static_cast<int>(s.padding);
    for (std::int64_t line = 0; line < 18; ++line) {
      const float* first = own.data.data() + line * s.columns;
      const auto row = reference.row({first, first + s.columns}, s.center, s.half, pad);
      BOOST_REQUIRE(static_cast<std::int64_t>(row.size()) == scan.geometry.columns);
      for (std::size_t i = 0; i < row.size(); ++i) {
        const double got = static_cast<double>(scan.data[static_cast<std::size_t>(line) * row.size() + i]);
        // Factors, their products with a sample and with a taper: each rounds to float32 once.
        BOOST_TEST(std::abs(got - row[i]) <= 4 * 0x1p-24 * std::abs(row[i]) + 0x1p-50);
      }
    }
    BOOST_TEST(scan.geometry.extension.before == reference.before);
    BOOST_TEST(scan.geometry.extension.after == reference.after);
    BOOST_TEST(scan.geometry.center == s.center + static_cast<double>(reference.before));
    BOOST_TEST(scan.geometry.extension.center == s.center);
  }
}

BOOST_AUTO_TEST_CASE(verify_makes_the_same_rows_to_the_bit_by_means_of_its_own) {
  std::mt19937 random(3);
  for (int i = 0; i < 60; ++i) {
    const auto columns = static_cast<std::int64_t>(14 + random() % 200);
    const double share = static_cast<double>(random()) / 4294967296.0,
                 center = 4.5 + share * static_cast<double>(columns - 10);
    const bool half = random() % 2 == 0;
    const Padding padding = std::array{Padding::none, Padding::edge, Padding::mirror}[random() % 3];
    const ProjectionSet own = turned(5, columns, center);
    ProjectionSet scan = own;
    FieldOptions field;
    static_cast<void>(extend_rows(scan, wanted(half, padding)));
    field.preparation = scan.report.preparation;
    const ProjectionSet again = rows_to_verify(own, field);
    BOOST_TEST((again.geometry == scan.geometry));
    BOOST_TEST((again.report.preparation == scan.report.preparation));
    BOOST_TEST((again.data == scan.data));
    // Beyond the limit longer rows lie in a scratch file, wherever those lay that were measured.
    const bool longer = scan.geometry.columns > columns;
    const std::uint64_t limit = 8 * sizeof(float) * own.data.size();
    const ProjectionSet mapped = rows_to_verify(own, field, limit);
    BOOST_TEST((mapped.data.scratch() != nullptr) == longer);
    BOOST_TEST((mapped.data == scan.data));
  }
}

BOOST_AUTO_TEST_CASE(shares_of_opposite_views_add_to_one) {
  ProjectionSet scan = turned(8, 50, 12.25);
  static_cast<void>(extend_rows(scan, wanted(true)));
  const std::vector<float> f = row_factors(scan.geometry);
  const double center = scan.geometry.center;  // 12.25 + 25: columns lie opposite each other a half apart
  BOOST_TEST(center == 37.25);
  for (std::size_t i = 0; i < f.size(); ++i) {
    const double t = static_cast<double>(i) - center;
    BOOST_TEST(std::abs(static_cast<double>(f[i]) - 2 * reference::share_of_view(t, 12.75)) <= 0x1p-22);
    BOOST_TEST(std::abs(reference::share_of_view(t, 12.75) + reference::share_of_view(-t, 12.75) - 1) <=
               0x1p-50);
  }
}

BOOST_AUTO_TEST_CASE(own_rows_are_what_was_measured) {
  for (const Shape& s : shapes()) {
    const ProjectionSet own = turned(9, s.columns, s.center);
    ProjectionSet scan = own;
    static_cast<void>(extend_rows(scan, wanted(s.half, s.padding)));
    const ProjectionSet back = own_rows(scan);
    BOOST_TEST(back.geometry.columns == s.columns);
    BOOST_TEST(back.geometry.center == s.center);
    for (std::size_t i = 0; i < own.data.size(); ++i)
      BOOST_TEST(std::abs(back.data[i] - own.data[i]) <= 0x1p-23f * std::abs(own.data[i]));
  }
}

BOOST_AUTO_TEST_CASE(it_is_recognised_by_axis_and_arc_and_said_so_unless_it_was_stated) {
  ProjectionSet scan = turned(90, 64, 9);
  BOOST_TEST(looks_half_acquired(scan.geometry));
  BOOST_TEST(extend_rows(scan, {}).find("half acquisition") == 0u);
  BOOST_TEST(scan.report.preparation.half_acquisition.value_or(false));
  ProjectionSet stated = turned(90, 64, 9);
  BOOST_TEST(extend_rows(stated, wanted(true)).empty());
  BOOST_TEST((stated.data == scan.data));
  ProjectionSet plain = turned(90, 64, 9);
  BOOST_TEST(extend_rows(plain, wanted(false)).empty());
  BOOST_TEST(plain.geometry.columns == 64);
  BOOST_TEST(!plain.report.preparation.half_acquisition.value_or(true));
  for (const double center : {30.0, 22.0}) {
    ProjectionSet usual = turned(90, 64, center);
    BOOST_TEST(extend_rows(usual, {}).empty());
    BOOST_TEST(!usual.report.preparation.half_acquisition.has_value());
  }
}

BOOST_AUTO_TEST_CASE(what_is_no_half_acquisition_is_refused_with_its_reason) {
  BOOST_TEST(refusal(turned(90, 64, 9, 180), wanted(true)).find("full turn") != std::string::npos);
  BOOST_TEST(refusal(turned(90, 64, 9, 300), {}).find("full turn") != std::string::npos);
  BOOST_TEST(refusal(turned(90, 64, 3), {}).find("overlap by 7.0 columns") != std::string::npos);
  BOOST_TEST(refusal(turned(90, 64, -2), wanted(true)).find("lies off the detector") != std::string::npos);
  BOOST_TEST(refusal(turned(90, 64, 4.5), {}).empty());
  // 400 degrees, odd numbers and jitter are full turns.
  BOOST_TEST(refusal(turned(101, 64, 9, 400), {}).empty());
  ProjectionSet shaken = turned(91, 64, 55);
  std::mt19937 random(5);
  for (double& theta : shaken.geometry.theta_rad)
    theta += 0.2 * 2 * std::numbers::pi / 91 * (static_cast<double>(random()) / 2147483648.0 - 1);
  BOOST_TEST(refusal(shaken, {}).empty());
}

BOOST_AUTO_TEST_CASE(weights_are_of_a_full_turn_and_the_covered_circle_is_that_of_the_longer_side) {
  ProjectionSet scan = turned(11, 64, 9);
  scan.geometry.theta_rad[3] += 0.1;
  const std::vector<double> turn = view_weights(scan.geometry.theta_rad, 2 * std::numbers::pi).weight;
  static_cast<void>(extend_rows(scan, {}));
  const std::vector<double> w = view_weights(scan.geometry).weight;
  for (std::size_t k = 0; k < w.size(); ++k) BOOST_TEST(w[k] == 0.5 * turn[k]);
  BOOST_TEST(std::abs(Coverage(scan.geometry).inner_radius() - 54.5) <= 1e-12);
  ProjectionSet padded = turned(11, 64, 22, 180);
  static_cast<void>(extend_rows(padded, wanted({}, Padding::edge)));
  BOOST_TEST(std::abs(Coverage(padded.geometry).inner_radius() - 22.5) <= 1e-12);
}

BOOST_AUTO_TEST_CASE(another_centre_needs_the_scan_read_again) {
  ProjectionSet scan = turned(90, 64, 9);
  static_cast<void>(extend_rows(scan, {}));
  FieldOptions field;
  field.center = 9;
  BOOST_TEST(center_of(field, scan.geometry) == scan.geometry.center);
  BOOST_TEST(stated_center({}, scan.geometry) == 9);
  field.center = 9.5;
  BOOST_CHECK_THROW(static_cast<void>(center_of(field, scan.geometry)), InputError);
}

BOOST_AUTO_TEST_CASE(rows_that_do_not_end_in_air_leave_a_note_unless_they_are_padded) {
  ProjectionSet scan = turned(30, 64, 31.5, 180);
  for (float& p : scan.data) p = 1;
  ProjectionSet padded = scan;
  static_cast<void>(extend_rows(scan, {}));
  BOOST_REQUIRE(scan.report.notes.size() == 1u);
  BOOST_TEST(scan.report.notes[0].find("do not end in air") != std::string::npos);
  static_cast<void>(extend_rows(padded, wanted({}, Padding::mirror)));
  BOOST_TEST(padded.report.notes.empty());
}
