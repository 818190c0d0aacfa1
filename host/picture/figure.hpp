// Figures for the page: false-colour panels with a colour bar, and panels of curves, with axes in cycles per
// sample, titles and captions.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "vdvr/expert/image.hpp"

namespace vdvr::figure {

struct Scale {
  double low = 0, high = 1;
  bool logarithmic = false;

  /// Where a value lies, 0 at low and 1 at high, clamped.
  [[nodiscard]] double fraction(double value) const;
  [[nodiscard]] double value(double fraction) const;
};

/// double values[y][x], side x side, row 0 at the top; x and y run over the frequencies from -1/2 to 1/2
/// cycle per sample, y upwards.
struct Raster {
  std::string title, x_label, y_label;
  std::int64_t side = 0;
  std::vector<double> values;
  Scale scale;
  double box = 0;  ///< a frame around the frequencies up to this part of Nyquist; 0: none
};

/// Curves over 0 to 1/2 cycle per sample; points are spread evenly from 0, the last one just before 1/2.
struct Curve {
  std::string label;
  std::vector<double> values;
};
struct Chart {
  std::string title, x_label;
  std::vector<Curve> curves;  ///< 4 at most
  Scale scale;
};

/// Dark to light, evenly in perceived lightness (the colours of viridis at nine stops).
std::array<std::uint8_t, 3> colour(double fraction);

/// Panels row by row, all of one side; then the caption, its paragraphs wrapped.
Image draw(const std::string& title, const std::vector<std::vector<Raster>>& rows,
           const std::vector<std::string>& caption);
Image draw(const std::string& title, const std::vector<Chart>& charts,
           const std::vector<std::string>& caption);

/// The same pairs of a single row: ceil(n / 2) values.
std::vector<double> paired(const std::vector<double>& coefficients);

/// Magnitudes float coefficients[n_y][n_x] of a cosine series as a panel shows them: mirrored to negative
/// frequencies, each pixel the largest of the coefficients that it covers, in pairs along each axis: a pair
/// of coefficients is as wide as one frequency of a Fourier transform, and in symmetric data one of the two
/// is 0.
std::vector<double> mirrored(const std::vector<double>& coefficients, std::int64_t n_x, std::int64_t n_y,
                             std::int64_t side);

}  // namespace vdvr::figure
