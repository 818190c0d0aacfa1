// Noise pushed through a preparation: what is prepared with one noise less what is with another.
#include "host/field/noise/passed_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/noise/field_variance.hpp"
#include "host/scan/photon_transfer.hpp"
#include "host/scan/prepare/prepare.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr std::int64_t most_looked_at = std::int64_t{1} << 22, most_rows = 64, fewest_rows = 4;
constexpr std::int64_t frequencies = 64, most_lags = 4;

// Which of the prepared rows and views are looked at.
struct Window {
  std::int64_t first_row = 0, rows = 0;
  std::vector<std::int64_t> views;
};

Window window_of(const ProjectionSet& prepared) {
  const ParallelGeometry& g = prepared.geometry;
  const Preparation& p = prepared.report.preparation;
  const std::int64_t of_row = g.columns * p.binning * p.binning;
  Window out;
  std::int64_t views = g.views();
  if (p.stripes) {
    out.rows = std::min(g.rows, std::clamp(most_looked_at / (of_row * views), fewest_rows, most_rows));
  } else {
    out.rows = std::min(g.rows, most_rows);
    views = std::clamp<std::int64_t>(most_looked_at / (of_row * out.rows), 1, views);
  }
  out.first_row = (g.rows - out.rows) / 2;
  for (std::int64_t k = 0; k < views; ++k) out.views.push_back((2 * k + 1) * g.views() / (2 * views));
  return out;
}

// A view of the prepared projections at the pixels of the unprepared ones, by lines between the former.
View unbinned(const ProjectionSet& prepared, const Window& window, std::int64_t k) {
  const ParallelGeometry& g = prepared.geometry;
  const int b = prepared.report.preparation.binning;
  View out{g.columns * b, window.rows * b, std::vector<double>(at(g.columns * b * window.rows * b))};
  struct Place {
    std::int64_t low, high;
    double t;
  };
  const auto place = [b](std::int64_t i, std::int64_t first, std::int64_t n) {
    const double at =
        std::clamp((static_cast<double>(i) - 0.5 * (b - 1)) / b, 0.0, static_cast<double>(n - 1));
    const auto low = static_cast<std::int64_t>(at);
    return Place{first + low, first + std::min(low + 1, n - 1), at - static_cast<double>(low)};
  };
  const float* view = prepared.data.data() + window.views[at(k)] * g.rows * g.columns;
  for (std::int64_t j = 0; j < out.rows; ++j) {
    const Place v = place(j, window.first_row, window.rows);
    for (std::int64_t i = 0; i < out.columns; ++i) {
      const Place u = place(i, 0, g.columns);
      const auto on_row = [&](std::int64_t row) {
        return std::lerp(static_cast<double>(view[row * g.columns + u.low]),
                         static_cast<double>(view[row * g.columns + u.high]), u.t);
      };
      out.at(i, j) = std::lerp(on_row(v.low), on_row(v.high), v.t);
    }
  }
  return out;
}

// Heights and columns that all views see are not always a whole number of binned ones.
struct DetectorSize {
  std::int64_t rows, columns;
  [[nodiscard]] std::size_t nearest(std::int64_t row, std::int64_t column) const {
    return at(std::clamp<std::int64_t>(row, 0, rows - 1) * columns +
              std::clamp<std::int64_t>(column, 0, columns - 1));
  }
};

// Noise of so many pixels for others about the same middle.
LineIntegralNoise fitted(LineIntegralNoise noise, const DetectorSize& from, const ParallelGeometry& to) {
  if (from.rows == to.rows && from.columns == to.columns) return noise;
  for (std::vector<float>* values : {&noise.photon, &noise.read}) {
    if (std::ssize(*values) <= 1) continue;
    std::vector<float> out;
    for (std::int64_t row = 0; row < to.rows; ++row)
      for (std::int64_t column = 0; column < to.columns; ++column)
        out.push_back((*values)[from.nearest(row + (from.rows - to.rows) / 2,
                                             column + (from.columns - to.columns) / 2)]);
    *values = std::move(out);
  }
  return noise;
}

// A view with two noises, and the difference of these. Box and Muller 1958.
struct NoisyPair {
  View one, other, difference;
};
NoisyPair with_noise(const View& view, const PixelVariance& variance, std::int64_t first_row,
                     const DetectorSize& detector, std::int64_t k) {
  std::mt19937_64 random(static_cast<std::uint64_t>(20060301 + k));
  const auto uniform = [&] { return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53; };
  NoisyPair out{view, view, view};
  for (std::int64_t j = 0; j < view.rows; ++j)
    for (std::int64_t i = 0; i < view.columns; ++i) {
      const double sigma = std::sqrt(variance(detector.nearest(first_row + j, i), view.at(i, j))),
                   length = sigma * std::sqrt(-2 * std::log(uniform())), angle = 2 * pi * uniform(),
                   a = length * std::cos(angle), b = length * std::sin(angle);
      out.one.at(i, j) += a;
      out.other.at(i, j) += b;
      out.difference.at(i, j) = a - b;
    }
  return out;
}

// Projections of so many views like `prepared`, before they were binned.
ProjectionSet like(const ProjectionSet& prepared, const Window& window) {
  const int b = prepared.report.preparation.binning;
  ProjectionSet out;
  out.geometry = prepared.geometry;
  out.geometry.columns *= b;
  out.geometry.rows = window.rows * b;
  out.geometry.pitch_u /= b;
  out.geometry.pitch_v /= b;
  out.geometry.theta_rad.clear();
  out.geometry.column_shift.clear();  // of views that are left out too, and noise does not follow them
  out.geometry.row_shift.clear();
  out.geometry.axis_roll_deg = 0;
  for (const std::int64_t k : window.views)
    out.geometry.theta_rad.push_back(prepared.geometry.theta_rad[at(k)]);
  out.data = SampleArray(std::vector<float>(at(out.size())));
  return out;
}

void put(const View& view, ProjectionSet& scan, std::int64_t k) {
  std::transform(view.data.begin(), view.data.end(), scan.data.begin() + k * std::ssize(view.data),
                 [](double sample) { return static_cast<float>(sample); });
}

// Rows at frequencies (m + 1/2) / 2n cycles a column, under Hann's window.
class RowSpectrum {
 public:
  using Row = std::array<std::complex<double>, frequencies>;

  explicit RowSpectrum(std::int64_t columns) : columns_(columns), table_(at(columns * frequencies)) {
    for (std::int64_t i = 0; i < columns; ++i) {
      const double window =
          0.5 - 0.5 * std::cos(2 * pi * (static_cast<double>(i) + 0.5) / static_cast<double>(columns));
      energy_.push_back(window * window);
      for (std::int64_t m = 0; m < frequencies; ++m)
        table_[at(i * frequencies + m)] = std::polar(window, 2 * pi * frequency(m) * static_cast<double>(i));
    }
  }
  static double frequency(std::int64_t m) { return (static_cast<double>(m) + 0.5) / (2 * frequencies); }
  // Of one row less another.
  [[nodiscard]] Row operator()(const float* one, const float* other) const {
    Row sum{};
    for (std::int64_t i = 0; i < columns_; ++i) {
      const double d = static_cast<double>(one[i]) - static_cast<double>(other[i]);
      for (std::int64_t m = 0; m < frequencies; ++m) sum[at(m)] += d * table_[at(i * frequencies + m)];
    }
    return sum;
  }
  // What a row of white noise has at each frequency.
  [[nodiscard]] double white(const double* noise) const {
    double sum = 0;
    for (std::int64_t i = 0; i < columns_; ++i) sum += energy_[at(i)] * noise[i] * noise[i];
    return sum;
  }

 private:
  std::int64_t columns_;
  std::vector<std::complex<double>> table_;
  std::vector<double> energy_;
};

// Sums over rows: powers, those of rows l apart after a ramp, and what white noise has.
struct Powers {
  std::array<double, frequencies> of{};
  std::array<double, most_lags + 1> lag{};
  std::array<std::int64_t, most_lags + 1> pairs{};
  double white = 0;

  void add(const Powers& o) {
    for (std::size_t m = 0; m < of.size(); ++m) of[m] += o.of[m];
    for (std::size_t l = 0; l < lag.size(); ++l) lag[l] += o.lag[l], pairs[l] += o.pairs[l];
    white += o.white;
  }
};

Powers powers_of(const RowSpectrum& spectrum, const float* one, const float* other, const View& white,
                 std::int64_t first, std::int64_t end) {
  Powers out;
  std::vector<RowSpectrum::Row> rows;
  for (std::int64_t j = first; j < end; ++j) {
    rows.push_back(spectrum(one + j * white.columns, other + j * white.columns));
    out.white += spectrum.white(white.data.data() + j * white.columns);
    for (std::size_t m = 0; m < out.of.size(); ++m) out.of[m] += std::norm(rows.back()[m]);
    for (std::size_t l = 0; l < std::min(rows.size(), out.lag.size()); ++l) {
      const RowSpectrum::Row& before = rows[rows.size() - 1 - l];
      for (std::int64_t m = 0; m < frequencies; ++m)
        out.lag[l] +=
            std::pow(RowSpectrum::frequency(m), 2) * (rows.back()[at(m)] * std::conj(before[at(m)])).real();
      ++out.pairs[l];
    }
  }
  return out;
}

}  // namespace

bool changes_noise(Preparation preparation) {
  // Sums of neighbours, and weights: noise is followed through them.
  preparation.binning = Preparation{}.binning;
  preparation.half_acquisition = {};
  preparation.padding = {};
  // Of normalisation, which the noise of counts has in it already.
  preparation.flats_in_time = preparation.beam_current = {};
  // S_v of rows of equal noise has that noise too, but for its correlation along z.
  preparation.heights = {};
  return !preparation.none();
}

LineIntegralNoise passed_noise(const LineIntegralNoise& noise, std::int64_t rows, std::int64_t columns,
                               const ProjectionSet& prepared, std::uint64_t max_memory_bytes) {
  const Preparation& p = prepared.report.preparation;
  const Window window = window_of(prepared);
  const auto views = std::ssize(window.views);
  // Two scans in float, their noise in double.
  io::require_memory(prepared.data.resident_bytes() +
                         16 * count(views * window.rows * prepared.geometry.columns * p.binning * p.binning),
                     max_memory_bytes, "the noise of prepared projections");
  ProjectionSet one = like(prepared, window), other = one;
  const ViewPreparation steps(p, one.geometry, false);
  const PixelVariance variance(noise);
  std::vector<View> white(at(views));
  parallel_for(views, {}, "", [&](std::int64_t k) {
    // Noise that is left in the prepared view would be taken for slopes.
    const View still = gaussian_filtered(unbinned(prepared, window, k), 1, 1);
    NoisyPair noisy = with_noise(still, variance, window.first_row * p.binning, {rows, columns}, k);
    white[at(k)] = binned(noisy.difference, p.binning);
    for (auto [view, scan] : {std::pair(&noisy.one, &one), std::pair(&noisy.other, &other)}) {
      steps.apply(*view);
      put(*view, *scan, k);
    }
  });
  for (ProjectionSet* scan : {&one, &other}) prepare_scan(*scan, p, max_memory_bytes, {});
  // Near edges steps see mirrored rows, which leaves more.
  const std::int64_t edge = window.rows / 4;
  const RowSpectrum spectrum(prepared.geometry.columns);
  std::vector<Powers> of_view(at(views));
  parallel_for(views, {}, "", [&](std::int64_t k) {
    const std::int64_t offset = k * window.rows * prepared.geometry.columns;
    of_view[at(k)] = powers_of(spectrum, one.data.data() + offset, other.data.data() + offset, white[at(k)],
                               edge, window.rows - edge);
  });
  Powers sum;
  for (const Powers& powers : of_view) sum.add(powers);
  LineIntegralNoise out = fitted(binned(noise, rows, columns, p.binning),
                                 {rows / p.binning, columns / p.binning}, prepared.geometry);
  for (const double power : sum.of) out.spectrum.push_back(static_cast<float>(power / sum.white));
  const double own = sum.lag[0] / static_cast<double>(sum.pairs[0]);
  for (std::size_t l = 1; l < sum.lag.size() && sum.pairs[l] > 0 && own > 0; ++l)
    out.row_correlation.push_back(static_cast<float>(sum.lag[l] / static_cast<double>(sum.pairs[l]) / own));
  return out;
}

}  // namespace vdvr
