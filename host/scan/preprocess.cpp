// Pre-processing of one projection at a time; see preprocess.hpp.
#include "host/scan/preprocess.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> mean_of(const io::Frames& frames, std::size_t size) {
  std::vector<double> sum(size, 0.0), frame(size);
  for (std::int64_t k = 0; k < frames.count; ++k) {
    frames.read(k, 1, frame.data());
    for (std::size_t i = 0; i < size; ++i) sum[i] += frame[i];
  }
  for (double& s : sum) s /= static_cast<double>(frames.count);
  return sum;
}

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

// Chessboard distance of every pixel to the nearest valid one, by one sweep down and one up.
std::vector<std::int64_t> distance_to_valid(const std::vector<bool>& dead, std::int64_t rows,
                                            std::int64_t columns) {
  const std::int64_t far = rows + columns;
  std::vector<std::int64_t> distance(dead.size());
  for (std::size_t i = 0; i < dead.size(); ++i) distance[i] = dead[i] ? far : 0;
  const auto sweep = [&](std::int64_t direction) {
    for (std::int64_t n = 0; n < rows * columns; ++n) {
      const std::int64_t i = direction > 0 ? n : rows * columns - 1 - n;
      const std::int64_t r = i / columns, c = i % columns;
      const auto relax = [&](std::int64_t dr, std::int64_t dc) {
        const std::int64_t y = r - direction * dr, x = c - direction * dc;
        if (y < 0 || y >= rows || x < 0 || x >= columns) return;
        auto& d = distance[static_cast<std::size_t>(i)];
        d = std::min(d, distance[static_cast<std::size_t>(y * columns + x)] + 1);
      };
      relax(0, 1), relax(1, -1), relax(1, 0), relax(1, 1);
    }
  };
  sweep(1);
  sweep(-1);
  return distance;
}

// The median of the valid pixels at chessboard distance d, the ring that closes the smallest square with any.
double ring_median(std::span<const double> view, const std::vector<bool>& dead, std::int64_t rows,
                   std::int64_t columns, std::int64_t pixel, std::int64_t d) {
  const std::int64_t r = pixel / columns, c = pixel % columns;
  std::vector<double> valid;
  const auto take = [&](std::int64_t y, std::int64_t x) {
    if (y < 0 || y >= rows || x < 0 || x >= columns) return;
    const auto i = static_cast<std::size_t>(y * columns + x);
    if (!dead[i]) valid.push_back(view[i]);
  };
  for (std::int64_t x = c - d; x <= c + d; ++x) take(r - d, x), take(r + d, x);
  for (std::int64_t y = r - d + 1; y < r + d; ++y) take(y, c - d), take(y, c + d);
  return median_of(valid);
}

}  // namespace

FlatField make_flat_field(const io::Frames& flats, const io::Frames& darks, std::int64_t rows,
                          std::int64_t columns, bool integer) {
  const auto size = static_cast<std::size_t>(rows * columns);
  FlatField field;
  field.dark = mean_of(darks, size);
  field.gain.assign(size, 0.0);
  std::vector<double> frame(size);
  // A blank flat among good ones would only scale the mean, so each is looked at alone.
  for (std::int64_t k = 0; k < flats.count; ++k) {
    flats.read(k, 1, frame.data());
    bool any = false;
    for (std::size_t i = 0; i < size; ++i) {
      any = any || (frame[i] - field.dark[i] > 0 && std::isfinite(frame[i]));
      if (frame[i] > field.largest_flat) field.largest_flat = frame[i], field.at_largest = 0;
      field.at_largest += frame[i] == field.largest_flat ? 1 : 0;
      field.gain[i] += frame[i];
    }
    if (!any)
      throw FileError(fmt::format(
          "{}: no pixel of this flat is above the dark; leave it out or measure it again", flats.name(k)));
  }
  std::vector<double> positive;
  for (std::size_t i = 0; i < size; ++i) {
    double& gain = field.gain[i];
    gain = gain / static_cast<double>(flats.count) - field.dark[i];
    if (!(gain > 0) || !std::isfinite(gain)) gain = nan;
    else positive.push_back(gain);
  }
  if (positive.empty())
    throw FileError(fmt::format("{}: no pixel of the averaged flats is above the dark", flats.name(0)));
  field.floor = integer ? 0.5 / median_of(positive) : 0x1p-17;
  return field;
}

std::int64_t to_line_integrals(std::span<double> counts, std::int64_t rows, std::int64_t columns,
                               const FlatField& field) {
  return to_line_integrals(counts, rows, columns, field, field.gain);
}

std::int64_t to_line_integrals(std::span<double> counts, std::int64_t rows, std::int64_t columns,
                               const FlatField& field, std::span<const double> gain) {
  std::vector<bool> dead(counts.size());
  std::int64_t replaced = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double transmission = (counts[i] - field.dark[i]) / gain[i];
    dead[i] = !(transmission > field.floor) || !std::isfinite(transmission);
    counts[i] = dead[i] ? nan : -std::log(transmission);
    replaced += dead[i] ? 1 : 0;
  }
  if (replaced == 0) return 0;
  if (replaced == static_cast<std::int64_t>(counts.size())) return replaced;
  const auto distance = distance_to_valid(dead, rows, columns);
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (dead[i])
      counts[i] = ring_median(counts, dead, rows, columns, static_cast<std::int64_t>(i), distance[i]);
  return replaced;
}

void subtract_air_background(std::span<double> view, std::int64_t rows, std::int64_t columns,
                             std::span<const std::pair<std::int64_t, std::int64_t>> air_columns) {
  // A mask, so that overlapping ranges do not count twice.
  std::vector<bool> air(static_cast<std::size_t>(columns), false);
  for (const auto& [first, last] : air_columns)
    for (std::int64_t c = first; c <= last; ++c) air[static_cast<std::size_t>(c)] = true;
  double n = 0, sum_x = 0;
  for (std::int64_t c = 0; c < columns; ++c)
    if (air[static_cast<std::size_t>(c)]) n += 1, sum_x += static_cast<double>(c);
  if (n < 2) throw InputError("the air background needs at least two different columns");
  // Columns relative to their mean make offset and slope independent: two sums instead of a 2 x 2 system.
  const double mean_x = sum_x / n;
  for (std::int64_t r = 0; r < rows; ++r) {
    double* row = view.data() + r * columns;
    double sum = 0, moment = 0, spread = 0;
    for (std::int64_t c = 0; c < columns; ++c) {
      if (!air[static_cast<std::size_t>(c)]) continue;
      const double x = static_cast<double>(c) - mean_x;
      sum += row[c];
      moment += x * row[c];
      spread += x * x;
    }
    const double offset = sum / n, slope = moment / spread;
    for (std::int64_t c = 0; c < columns; ++c) row[c] -= offset + slope * (static_cast<double>(c) - mean_x);
  }
}

}  // namespace vdvr
