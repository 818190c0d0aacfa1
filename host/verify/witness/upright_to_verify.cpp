#include "host/verify/witness/upright_to_verify.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr long double half_turn = std::numbers::pi_v<long double>;
constexpr long double slack = 1e-9L;  // of a pixel, as build has it

// What is left of a detector, and where its samples come from.
struct Lean {
  long double cosine = 1, sine = 0, row_height = 1;  // a row's height in columns
  std::int64_t U = 0, V = 0, rows = 0, columns = 0;

  [[nodiscard]] static long double from_middle(std::int64_t i, std::int64_t n) {
    return static_cast<long double>(i) - 0.5L * static_cast<long double>(n - 1);
  }
  // Where the column has the height of an upright row, in its rows; the sample stood higher by `moved`.
  [[nodiscard]] long double on_column(std::int64_t column, std::int64_t row, long double moved) const {
    const long double z = from_middle(row, rows) + moved;
    return (z - from_middle(column, U) * sine / row_height) / cosine + 0.5L * static_cast<long double>(V - 1);
  }
  // Where an upright row has its sample, in measured columns.
  [[nodiscard]] long double on_row(std::int64_t row, std::int64_t column, long double moved) const {
    const long double z = (from_middle(row, rows) + moved) * row_height;
    return from_middle(column, columns) * cosine + z * sine + 0.5L * static_cast<long double>(U - 1);
  }
};

void turn(std::vector<double>& along_columns, std::vector<double>& along_rows, std::size_t views,
          const Lean& lean) {
  if (along_columns.empty() && along_rows.empty()) return;
  along_columns.resize(views);
  along_rows.resize(views);
  for (std::size_t k = 0; k < views; ++k) {
    const long double u = along_columns[k], v = along_rows[k] * lean.row_height;
    along_columns[k] = static_cast<double>(lean.cosine * u - lean.sine * v);
    along_rows[k] = static_cast<double>((lean.sine * u + lean.cosine * v) / lean.row_height);
  }
}

// As many rows and columns as all views see, fewer from the whole detector on.
void fit(Lean& lean, long double range) {
  const long double across = std::abs(lean.sine), wide = static_cast<long double>(lean.U - 1);
  lean.rows = lean.V;
  while (lean.rows > 0 && static_cast<long double>(lean.rows - 1) + range + across * wide / lean.row_height >
                              lean.cosine * static_cast<long double>(lean.V - 1) + slack)
    --lean.rows;
  const long double highest = 0.5L * (static_cast<long double>(lean.rows - 1) + range) * lean.row_height;
  lean.columns = lean.U;
  while (lean.columns > 0 &&
         0.5L * static_cast<long double>(lean.columns - 1) * lean.cosine + highest * across >
             0.5L * wide + slack * lean.cosine)
    lean.columns -= 2;
  if (lean.rows < 1 || lean.columns < 2)
    throw InputError("rows_to_verify: the axis leans too far for this detector");
}

// double sums[place][view] of double samples[sample][view].
void apply(const std::vector<double>& weights, const std::vector<double>& samples, std::int64_t views,
           std::vector<double>& sums) {
  std::fill(sums.begin(), sums.end(), 0.0);
  for (std::size_t s = 0; s < weights.size(); ++s)
    for (std::int64_t k = 0; k < views; ++k) sums[at(k)] += weights[s] * samples[s * at(views) + at(k)];
}

// Views that stood at the same height, whose weights are the same: float view[k][V][U] to
// out[k][rows][columns].
void make_upright(const Lean& lean, const float* views, std::int64_t count, long double moved, float* out) {
  const std::int64_t U = lean.U, V = lean.V;
  const SeriesWeights of_column(V), of_row(U);
  std::vector<double> heights(at(lean.rows * U * count));  // [row][measured column][view]
  parallel_for(U, {}, "", [&](std::int64_t i) {
    std::vector<double> column(at(V * count)), sums(at(count));
    for (std::int64_t v = 0; v < V; ++v)
      for (std::int64_t k = 0; k < count; ++k)
        column[at(v * count + k)] = static_cast<double>(views[(k * V + v) * U + i]);
    for (std::int64_t j = 0; j < lean.rows; ++j) {
      apply(of_column(lean.on_column(i, j, moved)), column, count, sums);
      std::copy(sums.begin(), sums.end(), heights.begin() + (j * U + i) * count);
    }
  });
  parallel_for(lean.rows, {}, "", [&](std::int64_t j) {
    const auto first = heights.begin() + j * U * count;
    const std::vector<double> row(first, first + U * count);
    std::vector<double> sums(at(count));
    for (std::int64_t i = 0; i < lean.columns; ++i) {
      apply(of_row(lean.on_row(j, i, moved)), row, count, sums);
      for (std::int64_t k = 0; k < count; ++k)
        out[(k * lean.rows + j) * lean.columns + i] = static_cast<float>(sums[at(k)]);
    }
  });
}

}  // namespace

SeriesWeights::SeriesWeights(std::int64_t n) {
  for (std::int64_t v = 0; v < n; ++v) {
    const long double b = half_turn * (static_cast<long double>(v) + 0.5L) / static_cast<long double>(n);
    cosine_.push_back(std::cos(b));
    signed_sine_.push_back((v % 2 == 0 ? 1 : -1) * std::sin(b));
  }
}

std::vector<double> SeriesWeights::operator()(long double y) const {
  const auto n = std::ssize(cosine_);
  const auto samples = static_cast<long double>(n);
  std::vector<double> weights(at(n), 0.0);
  const auto nearest = std::clamp<std::int64_t>(std::llround(y), 0, n - 1);
  const long double place = std::cos(half_turn * (y + 0.5L) / samples);
  // A sample that is hit is what is wanted; closer than this no double can tell.
  if (std::abs(y - static_cast<long double>(nearest)) < 1e-18L * samples || cosine_[at(nearest)] == place) {
    weights[at(nearest)] = 1;
    return weights;
  }
  std::vector<long double> terms;
  long double sum = 0;
  for (std::int64_t v = 0; v < n; ++v) {
    terms.push_back(signed_sine_[at(v)] / (cosine_[at(v)] - place));
    sum += terms.back();
  }
  for (std::int64_t v = 0; v < n; ++v) weights[at(v)] = static_cast<double>(terms[at(v)] / sum);
  return weights;
}

void to_upright_rows(ProjectionSet& scan, const RowsRoom& room) {
  ParallelGeometry& g = scan.geometry;
  const long double roll = static_cast<long double>(g.axis_roll_deg) * half_turn / 180;
  Lean lean{std::cos(roll), std::sin(roll),
            static_cast<long double>(g.pitch_v) / static_cast<long double>(g.pitch_u), g.columns, g.rows};
  turn(g.column_shift, g.row_shift, g.theta_rad.size(), lean);
  long double top = 0, bottom = 0;
  if (!g.row_shift.empty()) {
    top = *std::max_element(g.row_shift.begin(), g.row_shift.end());
    bottom = *std::min_element(g.row_shift.begin(), g.row_shift.end());
  }
  fit(lean, top - bottom);
  SampleArray out(at(g.views() * lean.rows * lean.columns), room(g.views(), lean.rows, lean.columns),
                  "the projections on upright rows");
  constexpr std::int64_t most_samples = std::int64_t{1} << 23;  // 64 MiB of doubles
  const std::int64_t together =
      g.row_shift.empty() ? std::clamp<std::int64_t>(most_samples / (lean.rows * g.columns), 1, g.views())
                          : 1;
  for (std::int64_t k = 0; k < g.views(); k += together) {
    const long double moved =
        g.row_shift.empty() ? 0 : static_cast<long double>(g.row_shift[at(k)]) - 0.5L * (top + bottom);
    make_upright(lean, scan.data.data() + k * g.rows * g.columns, std::min(together, g.views() - k), moved,
                 out.data() + k * lean.rows * lean.columns);
  }
  scan.data = std::move(out);
  g.extension.cut = (g.columns - lean.columns) / 2;
  g.extension.common_heights = true;
  g.center -= static_cast<double>(g.extension.cut);
  g.columns = lean.columns;
  g.rows = lean.rows;
}

}  // namespace vdvr
