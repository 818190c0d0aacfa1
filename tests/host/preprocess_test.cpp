#define BOOST_TEST_MODULE preprocess
#include "host/scan/preprocess.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>

#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

io::Frames frames(std::vector<std::vector<double>> data) {
  io::Frames f;
  f.count = static_cast<std::int64_t>(data.size());
  f.name = [](std::int64_t k) { return "frame " + std::to_string(k); };
  f.read = [data](std::int64_t first, std::int64_t n, double* out) {
    for (std::int64_t k = 0; k < n; ++k)
      out = std::copy(data[static_cast<std::size_t>(first + k)].begin(),
                      data[static_cast<std::size_t>(first + k)].end(), out);
  };
  return f;
}

// A subtraction, a division and a logarithm in double, each to an ulp, on values of this magnitude.
double near(double value) { return tolerance::fp64_sum(8, std::abs(value) + 1); }

bool message_has(const Error& e, const std::string& text) {
  return std::string(e.what()).find(text) != std::string::npos;
}

}  // namespace

BOOST_AUTO_TEST_CASE(line_integral_is_minus_log_of_the_flat_fielded_count) {
  const FlatField field =
      make_flat_field(frames({{1010, 2010}, {1030, 2030}}), frames({{10, 20}, {30, 40}}), 1, 2, true);
  BOOST_TEST(field.dark[0] == 20);
  BOOST_TEST(field.gain[1] == 1990);
  std::vector<double> counts{20 + 500, 30 + 199};
  BOOST_TEST(to_line_integrals(counts, 1, 2, field) == 0);
  BOOST_TEST(std::abs(counts[0] - std::log(2.0)) <= near(1));
  BOOST_TEST(std::abs(counts[1] - std::log(10.0)) <= near(3));
}

BOOST_AUTO_TEST_CASE(floor_is_half_a_count_over_the_median_gain_for_whole_numbers) {
  BOOST_TEST(make_flat_field(frames({{100, 200, 400}}), frames({{0, 0, 0}}), 1, 3, true).floor == 0.5 / 200);
  BOOST_TEST(make_flat_field(frames({{1, 1, 1}}), frames({{0, 0, 0}}), 1, 3, false).floor == 0x1p-17);
}

BOOST_AUTO_TEST_CASE(dead_pixel_gets_the_median_of_its_neighbours_and_is_counted) {
  const std::vector<double> dark(9, 0.0);
  std::vector<double> flat(9, 1000.0);
  flat[4] = 0;  // no gain
  const FlatField field = make_flat_field(frames({flat}), frames({dark}), 3, 3, true);
  std::vector<double> counts;
  for (int i = 0; i < 9; ++i) counts.push_back(1000 * std::exp(-0.1 * (i + 1)));
  BOOST_TEST(to_line_integrals(counts, 3, 3, field) == 1);
  // Neighbours 0.1 .. 0.9 without 0.5: the median is the mean of 0.4 and 0.6.
  BOOST_TEST(std::abs(counts[4] - 0.5) <= near(0.5));
}

BOOST_AUTO_TEST_CASE(negative_zero_and_not_a_number_counts_are_dead_pixels) {
  const FlatField field = make_flat_field(frames({std::vector<double>(6, 1000.0)}),
                                          frames({std::vector<double>(6, 0.0)}), 1, 6, true);
  std::vector<double> counts{1000, -3, 1000, 0, 1000, nan_value};
  BOOST_TEST(to_line_integrals(counts, 1, 6, field) == 3);
  for (const double p : counts) BOOST_TEST(p == 0);
}

BOOST_AUTO_TEST_CASE(window_widens_when_all_neighbours_are_dead) {
  const FlatField field = make_flat_field(frames({std::vector<double>(25, 1000.0)}),
                                          frames({std::vector<double>(25, 0.0)}), 5, 5, true);
  std::vector<double> counts(25, 1000 * std::exp(-1.0));
  for (int r = 1; r <= 3; ++r)
    for (int c = 1; c <= 3; ++c) counts[static_cast<std::size_t>(5 * r + c)] = 0;
  BOOST_TEST(to_line_integrals(counts, 5, 5, field) == 9);
  for (const double p : counts) BOOST_TEST(std::abs(p - 1) <= near(1));
}

BOOST_AUTO_TEST_CASE(only_one_valid_pixel_fills_the_whole_projection) {
  const FlatField field = make_flat_field(frames({std::vector<double>(35, 1000.0)}),
                                          frames({std::vector<double>(35, 0.0)}), 5, 7, true);
  std::vector<double> counts(35, 0.0);
  counts[33] = 1000 * std::exp(-2.0);
  BOOST_TEST(to_line_integrals(counts, 5, 7, field) == 34);
  for (const double p : counts) BOOST_TEST(std::abs(p - 2) <= near(2));
}

BOOST_AUTO_TEST_CASE(wholly_dead_projection_is_told_by_its_count) {
  const FlatField field = make_flat_field(frames({{1000, 1000}}), frames({{0, 0}}), 1, 2, true);
  std::vector<double> counts{0, 0};
  BOOST_TEST(to_line_integrals(counts, 1, 2, field) == 2);
}

BOOST_AUTO_TEST_CASE(largest_count_of_the_flats_and_how_many_have_it_are_known) {
  const FlatField field = make_flat_field(frames({{100, 4095}, {4095, 4095}}), frames({{0, 0}}), 1, 2, true);
  BOOST_TEST(field.largest_flat == 4095);
  BOOST_TEST(field.at_largest == 3);
}

BOOST_AUTO_TEST_CASE(blank_flat_is_refused_by_name_even_among_good_ones) {
  BOOST_CHECK_EXCEPTION(make_flat_field(frames({{9, 9}, {0, 0}}), frames({{1, 1}}), 1, 2, true), FileError,
                        [](const FileError& e) { return message_has(e, "frame 1"); });
  BOOST_CHECK_THROW(make_flat_field(frames({{nan_value, nan_value}}), frames({{1, 1}}), 1, 2, true),
                    FileError);
}

BOOST_AUTO_TEST_CASE(air_background_is_the_line_through_the_air_columns_of_each_row) {
  constexpr std::int64_t rows = 2, columns = 12;
  std::vector<double> view(rows * columns);
  for (std::int64_t r = 0; r < rows; ++r)
    for (std::int64_t c = 0; c < columns; ++c) {
      const double object = c >= 4 && c <= 7 ? 1.5 : 0;
      view[static_cast<std::size_t>(r * columns + c)] =
          object + 0.4 - 0.01 * static_cast<double>(c) + static_cast<double>(r);
    }
  const std::vector<std::pair<std::int64_t, std::int64_t>> air{{0, 3}, {2, 3}, {8, 11}};
  subtract_air_background(view, rows, columns, air);
  for (std::int64_t i = 0; i < rows * columns; ++i) {
    const std::int64_t c = i % columns;
    BOOST_TEST(std::abs(view[static_cast<std::size_t>(i)] - (c >= 4 && c <= 7 ? 1.5 : 0)) <=
               tolerance::fp64_sum(8 * columns, 2));
  }
}
