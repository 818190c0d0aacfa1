// What a detector does to one noise-free view: noise, median, Gaussian blur, binning (the paper's section 5
// recipe). Views are double view[v][u]. Edges are mirrored about the last pixel's outer side. Called by
// simulate.cpp.
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

/// Adds normal deviates of the given standard deviation: Box-Muller on std::mt19937_64, whose stream is fixed
/// by the standard and seeded (seed, view): the same on every platform (up to the last bit of log and cos)
/// and any thread count.
void add_noise(View& view, double sigma, std::uint64_t seed, std::int64_t view_index);
/// Median of side x side windows, side odd. Cost: side^2 per pixel.
View median_filtered(const View& view, int side);
/// Separable sampled Gaussian, normalised, cut at 5 standard deviations (where it is 4e-6 of its peak).
View gaussian_filtered(const View& view, double sigma_u, double sigma_v);
/// Means of factor x factor pixels; rows and columns must be multiples of factor.
View binned(const View& view, int factor);

}  // namespace vdvr
