// The certified volume as VTK sees it: image data with values at points, box by box, each box as fine as its
// finest brick. Boxes share the points of their common faces, so V is continuous from one to the next.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

/// A box of bricks as one vtkImageData: point (i, j, k) lies at origin + spacing * (i, j, k), extents as VTK
/// has them. All blocks have the volume's origin and spacings that differ by powers of two, so a point that
/// two blocks share has the same coordinates in both, to the bit.
struct VtkBlock {
  Index3 first_brick{}, bricks{};  ///< x, y, z
  std::array<int, 3> per_cell{};   ///< log2 of its samples per cell of the grid, x, y, z; may be negative
  std::array<std::int64_t, 6> extent{};  ///< of points: x first and last, y, z
  Vec3 origin{}, spacing{};
  [[nodiscard]] Index3 points() const {
    return {extent[1] - extent[0] + 1, extent[3] - extent[2] + 1, extent[5] - extent[4] + 1};
  }
  [[nodiscard]] std::int64_t point_count() const {
    const Index3 n = points();
    return n[0] * n[1] * n[2];
  }
};

/// Boxes that fill the grid. Bricks of one level triple become one box; others join where that adds fewer
/// points than a block is worth, and the worth is raised until there are at most `most_blocks` (as near as
/// the limit of 2^24 points a block allows). In a box of several triples the coarser bricks are interpolated,
/// which changes V between their samples by at most ExportResult::jump. Throws InputError where a VTK extent
/// would not fit its 32 bits. Cost: a few passes over the bricks; memory: 8 bytes a brick.
VDVR_API std::vector<VtkBlock> vtk_blocks(const MixedVolume& volume, std::size_t most_blocks = 2000);

/// V, as sample_at gives it, at the points of planes first_plane ... (counted within the block) of a block, x
/// fastest: two blocks that share a point have the same value there, to the bit. `out` has a whole number of
/// planes. Runs on the calling thread.
VDVR_API void vtk_block_samples(const MixedVolume& volume, const VtkBlock& block, std::int64_t first_plane,
                                std::span<float> out);

struct VtkOptions {
  std::size_t most_blocks = 2000;
  Compression compression = Compression::deflate;  ///< zlib, as vtkZLibDataCompressor; or raw
  std::uint64_t max_memory_bytes = 0;              ///< of the volume and this work together; 0: no limit
};
struct VtkResult {
  std::size_t blocks = 0;
  std::uint64_t points = 0, bytes = 0;
  double jump = 0;  ///< as in ExportResult
};

/// PATH.vtm, a vtkMultiBlockDataSet with one block per level triple, and a folder PATH with its .vti files
/// (float32 `density` at points, appended, UInt64 headers; field data `epsilon_abs`, `unit`,
/// `content_sha256`). Errors as export_volume.
VDVR_API VtkResult write_vtk(const VdvrFile& file, const std::filesystem::path& path,
                             const VtkOptions& options, const Progress& progress = {});

}  // namespace vdvr
