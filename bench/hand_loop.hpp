// The same back-projection as kernels/field/fbp/back_project.cl with linear u, written by hand for AVX-512:
// per update two loads and two fused multiply-adds. What the engine is measured against; never part of the
// library. Called by back_project_bench.cpp.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vdvr::bench {

/// Why the loop cannot run here, or an empty text.
std::string hand_loop_missing();

/// float filtered[z / 16][view][column][16]; the samples of column (x, y) lie at x step + first, y step +
/// first, and fall on upsampled column (x cos + y sin) scale + offset of a view.
struct HandLoop {
  std::span<const float> filtered;
  std::int64_t views = 0, columns = 0, chunks = 0;  ///< chunks of 16 z, an even number
  std::int64_t nx = 0, ny = 0;                      ///< nx a multiple of 8
  double first = 0, step = 1, scale = 1, offset = 0;
  std::vector<double> theta_rad;
};

/// out[y][x][chunks * 16], on all cores. Every position must fall on the columns: the caller pads them.
void run_hand_loop(const HandLoop& loop, std::span<float> out);

}  // namespace vdvr::bench
