// V on samples of a lattice finer or coarser than the grid's cells, brick by brick.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "vdvr/expert/certified_points.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// Samples every 2^-per_cell cells; sample 0 lies at the grid's origin. Axis order x, y, z.
struct SampleBox {
  std::array<int, 3> per_cell{};
  Index3 first{}, count{};
  /// Bricks that answer, half-open: on the box's outer faces these and not their neighbours.
  Index3 first_brick{}, end_brick{};
};

/// Of the whole volume, oversampling 2^log2 of every axis: the box of `planes` planes from `first` on.
SampleBox planes_of(const MixedVolume& volume, int log2_per_cell, std::int64_t first, std::int64_t planes);
/// Its samples along x, y, z.
Index3 fine_samples(const Grid& grid, int log2_per_cell);

/// The lattice as such a box; none where its spacing is no cell over a power of two.
std::optional<SampleBox> exact_box(const MixedVolume& volume, const Lattice& lattice);

/// Values to out[z stride_z + y stride_y + x], on the calling thread. Places are exact: no coordinate is
/// rounded, however large the grid.
void sample_box(const MixedVolume& volume, const SampleBox& box, std::int64_t stride_y, std::int64_t stride_z,
                float* out);
/// The same on all cores, the box contiguous.
void sample_box_parallel(const MixedVolume& volume, const SampleBox& box, float* out);

/// Least and largest value of V: of the samples that its bricks store.
std::pair<double, double> range_of_samples(const MixedVolume& volume, const Progress& progress);

/// How far two bricks disagree on what they share: the largest |own value - that of the brick which the point
/// belongs to| over the points of a brick's far faces where either stores a sample. What interpolation of V
/// at such points adds to V between them.
double largest_jump(const MixedVolume& volume, const Progress& progress);

/// What the volume holds in memory.
std::uint64_t resident_bytes(const MixedVolume& volume);
/// ResourceError where it, `shared` and `per_core` on every core exceed `limit` (0: none).
void require_memory_of_cores(const MixedVolume& volume, std::uint64_t per_core, std::uint64_t shared,
                             std::uint64_t limit, const std::string& what);

}  // namespace vdvr
