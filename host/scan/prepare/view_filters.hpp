// Median, Gaussian blur and binning of one view: what a detector does to it (the paper's section 5), and what
// may be done to it before it is certified. Views are double view[v][u]. Edges are mirrored about the last
// pixel's outer side.
#pragma once

#include <cstdint>
#include <vector>

namespace vdvr {

struct View {
  std::int64_t columns = 0, rows = 0;
  std::vector<double> data;
  double& at(std::int64_t i, std::int64_t j) { return data[static_cast<std::size_t>(j * columns + i)]; }
  [[nodiscard]] const double& at(std::int64_t i, std::int64_t j) const {
    return data[static_cast<std::size_t>(j * columns + i)];
  }
};

/// Half-sample mirror: the pixel of 0 .. n-1 that index i shows.
std::int64_t mirrored(std::int64_t i, std::int64_t n);

/// Median of side x side windows, side odd. Cost: side^2 per pixel.
View median_filtered(const View& view, int side);
/// Separable sampled Gaussian, normalised, cut at 5 standard deviations (where it is 4e-6 of its peak).
View gaussian_filtered(const View& view, double sigma_u, double sigma_v);
/// Means of factor x factor pixels; columns and rows that do not fill one are left out at the end.
View binned(const View& view, int factor);

}  // namespace vdvr
