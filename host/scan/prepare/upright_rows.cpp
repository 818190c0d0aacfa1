// Two passes of chirp sums. Equations in the header.
#include "host/scan/prepare/upright_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/prepare/chirp_sums.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/scratch.hpp"

namespace vdvr {
namespace {

constexpr double half_turn_rad = std::numbers::pi;
constexpr double pixel_slack = 1e-9;  // rounding takes no row or column away

double middle_of(std::int64_t n) { return 0.5 * static_cast<double>(n - 1); }

// The turned detector in pixels, and what every view sees of it. `aspect`: a row's height in columns.
struct Turned {
  double c = 1, s = 0, aspect = 1, shift_range = 0, shift_middle = 0;
  std::int64_t rows = 0, cut = 0;
};

Turned turned(const ParallelGeometry& g) {
  const double roll = g.axis_roll_deg * radians_per_degree;
  Turned out;
  out.c = std::cos(roll);
  out.s = std::sin(roll);
  out.aspect = g.pitch_v / g.pitch_u;
  if (!g.row_shift.empty()) {
    const auto [least, most] = std::minmax_element(g.row_shift.begin(), g.row_shift.end());
    out.shift_range = *most - *least;
    out.shift_middle = 0.5 * (*least + *most);
  }
  const double wide = static_cast<double>(g.columns - 1), high = static_cast<double>(g.rows - 1),
               lean = std::abs(out.s);
  out.rows = static_cast<std::int64_t>(
      std::floor(1 + out.c * high - lean * wide / out.aspect - out.shift_range + pixel_slack));
  if (out.rows < 1)
    throw InputError(fmt::format(
        "an axis roll of {:g} degrees leaves no height that all {} columns of {} rows see: {:.1f} rows are "
        "needed "
        "and more",
        g.axis_roll_deg, g.columns, g.rows, 1 + (lean * wide / out.aspect + out.shift_range) / out.c));
  const double reach = (middle_of(out.rows) + 0.5 * out.shift_range) * lean * out.aspect;
  out.cut = std::max<std::int64_t>(
      0, static_cast<std::int64_t>(
             std::ceil(middle_of(g.columns) - (middle_of(g.columns) - reach) / out.c - pixel_slack)));
  if (g.columns - 2 * out.cut < 2)
    throw InputError(fmt::format(
        "an axis roll of {:g} degrees leaves {} of {} columns that all {} common heights have: read fewer "
        "rows",
        g.axis_roll_deg, std::max<std::int64_t>(0, g.columns - 2 * out.cut), g.columns, out.rows));
  return out;
}

// The cosine series through lines of n samples, at places `out` of them that are `step` apart. Two lines at a
// time: one is the real part, the other the imaginary one.
class LineSampler {
 public:
  using Complex = ChirpSums::Complex;

  LineSampler(std::int64_t n, std::int64_t out, double step)
      : n_(n),
        // sum of x[v] e^(-i pi m v / n) for |m| < n
        analyse_({0, n}, {1 - n, 2 * n - 1}, -0.5L / static_cast<long double>(n)),
        evaluate_({1 - n, 2 * n - 1}, {0, out},
                  0.5L * static_cast<long double>(step) / static_cast<long double>(n)) {
    for (std::int64_t m = 0; m < n; ++m)
      half_.push_back(std::polar(1 / static_cast<double>(n),
                                 -half_turn_rad * static_cast<double>(m) / (2 * static_cast<double>(n))));
  }

  // `first`: the place of the first sample of either line.
  void operator()(std::span<const Complex> lines, const std::array<double, 2>& first,
                  std::span<Complex> samples) const {
    std::vector<Complex> sums(at(2 * n_ - 1)), series(sums.size());
    analyse_(lines, sums);
    for (std::int64_t m = 0; m < n_; ++m) {
      // Half the cosine coefficient of either line, that of m = 0 whole: the mean of the sums at m and -m.
      const Complex own =
          0.5 * (sums[at(n_ - 1 + m)] * half_[at(m)] + sums[at(n_ - 1 - m)] * std::conj(half_[at(m)]));
      const Complex a = own.real() * wave(m, first[0]), b = own.imag() * wave(m, first[1]);
      series[at(n_ - 1 + m)] = a + Complex(-b.imag(), b.real());
      series[at(n_ - 1 - m)] = std::conj(a) + Complex(b.imag(), b.real());
    }
    evaluate_(series, samples);
  }

 private:
  [[nodiscard]] Complex wave(std::int64_t m, double place) const {
    return std::polar(1.0, half_turn_rad * static_cast<double>(m) * (place + 0.5) / static_cast<double>(n_));
  }

  std::int64_t n_;
  ChirpSums analyse_, evaluate_;
  std::vector<Complex> half_;
};

// One view: float view[rows][columns] to float out[turned.rows][columns - 2 cut].
class ViewTurner {
 public:
  ViewTurner(const ParallelGeometry& g, const Turned& t)
      : g_(g),
        t_(t),
        columns_(g.columns - 2 * t.cut),
        along_columns_(g.rows, t.rows, 1 / t.c),
        along_rows_(g.columns, columns_, t.c) {}

  void operator()(const float* view, double shift, float* out) const {
    const std::int64_t U = g_.columns, V = g_.rows;
    std::vector<double> heights(at(t_.rows * U));  // [row][measured column]
    std::vector<LineSampler::Complex> lines(at(V)), samples(at(t_.rows));
    for (std::int64_t i = 0; i < U; i += 2) {
      const bool two = i + 1 < U;
      for (std::int64_t v = 0; v < V; ++v)
        lines[at(v)] = {static_cast<double>(view[v * U + i]),
                        two ? static_cast<double>(view[v * U + i + 1]) : 0.0};
      along_columns_(lines, {height(i, shift), height(i + 1, shift)}, samples);
      for (std::int64_t j = 0; j < t_.rows; ++j) {
        heights[at(j * U + i)] = samples[at(j)].real();
        if (two) heights[at(j * U + i + 1)] = samples[at(j)].imag();
      }
    }
    lines.resize(at(U));
    samples.resize(at(columns_));
    for (std::int64_t j = 0; j < t_.rows; j += 2) {
      const bool two = j + 1 < t_.rows;
      for (std::int64_t i = 0; i < U; ++i)
        lines[at(i)] = {heights[at(j * U + i)], two ? heights[at((j + 1) * U + i)] : 0.0};
      along_rows_(lines, {place(j, shift), place(j + 1, shift)}, samples);
      for (std::int64_t i = 0; i < columns_; ++i) {
        out[j * columns_ + i] = static_cast<float>(samples[at(i)].real());
        if (two) out[(j + 1) * columns_ + i] = static_cast<float>(samples[at(i)].imag());
      }
    }
  }

 private:
  // Of the first row, in the column's rows.
  [[nodiscard]] double height(std::int64_t column, double shift) const {
    const double u = static_cast<double>(column) - middle_of(g_.columns);
    return middle_of(g_.rows) + (shift - middle_of(t_.rows)) / t_.c - u * t_.s / t_.c / t_.aspect;
  }
  // Of the row's first sample, in measured columns.
  [[nodiscard]] double place(std::int64_t row, double shift) const {
    const double z = static_cast<double>(row) - middle_of(t_.rows) + shift;
    return middle_of(g_.columns) - middle_of(columns_) * t_.c + z * t_.s * t_.aspect;
  }

  const ParallelGeometry& g_;
  const Turned& t_;
  std::int64_t columns_;
  LineSampler along_columns_, along_rows_;
};

}  // namespace

void turn_shifts(ParallelGeometry& g) {
  if (g.column_shift.empty() && g.row_shift.empty()) return;
  const double roll = g.axis_roll_deg * radians_per_degree, c = std::cos(roll), s = std::sin(roll),
               aspect = g.pitch_v / g.pitch_u;
  g.column_shift.resize(g.theta_rad.size(), 0.0);
  g.row_shift.resize(g.theta_rad.size(), 0.0);
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
    const double u = g.column_shift[k], v = g.row_shift[k] * aspect;
    g.column_shift[k] = u * c - v * s;
    g.row_shift[k] = (u * s + v * c) / aspect;
  }
}

void upright_rows(ProjectionSet& scan, std::uint64_t max_memory_bytes, const std::filesystem::path& scratch) {
  ParallelGeometry& g = scan.geometry;
  require_axis_roll(g.axis_roll_deg, "axis roll");
  turn_shifts(g);
  const Turned t = turned(g);
  const std::int64_t columns = g.columns - 2 * t.cut;
  const auto size = static_cast<std::uint64_t>(g.views() * t.rows * columns);
  auto room = scratch_for_scan(g.views(), t.rows, columns, max_memory_bytes, scratch);
  io::require_memory(scan.data.resident_bytes() + (room ? max_memory_bytes / 8 : size * sizeof(float)),
                     max_memory_bytes, fmt::format("{} rows of {} columns, upright", t.rows, columns));
  SampleArray out(size, std::move(room), "the projections on upright rows");
  const ViewTurner turn(g, t);
  parallel_for(g.views(), {}, "", [&](std::int64_t k) {
    const double shift = g.row_shift.empty() ? 0 : g.row_shift[at(k)] - t.shift_middle;
    turn(scan.data.data() + k * g.rows * g.columns, shift, out.data() + k * t.rows * columns);
  });
  scan.data = std::move(out);
  scan.report.notes.push_back(
      fmt::format("upright rows: of {} x {} pixels the axis, which leans by {:g} degrees, leaves {} columns "
                  "x {} rows that "
                  "every view sees whole; z = 0 is at the detector's middle",
                  g.columns, g.rows, g.axis_roll_deg, columns, t.rows));
  g.rows = t.rows;
  g.columns = columns;
  g.center -= static_cast<double>(t.cut);
  g.extension.common_heights = true;
  g.extension.cut = t.cut;
  scan.report.preparation.heights = Heights::common;
}

std::int64_t nearest_pixel(const ParallelGeometry& upright, std::int64_t rows, std::int64_t columns,
                           std::int64_t row, std::int64_t column) {
  const double roll = upright.axis_roll_deg * radians_per_degree, c = std::cos(roll), s = std::sin(roll),
               aspect = upright.pitch_v / upright.pitch_u;
  const double t = static_cast<double>(column) - middle_of(upright.columns),
               z = (static_cast<double>(row) - middle_of(upright.rows)) * aspect;
  const auto nearest = [](double place, std::int64_t n) {
    return std::clamp<std::int64_t>(std::llround(place + middle_of(n)), 0, n - 1);
  };
  return nearest((z * c - t * s) / aspect, rows) * columns + nearest(t * c + z * s, columns);
}

}  // namespace vdvr
