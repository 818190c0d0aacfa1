// Which bricks `verify` tests (docs/error-bounds.md, "What verify does", "Which cells are tested").
#pragma once

#include <cstdint>
#include <vector>

#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/verify.hpp"

namespace vdvr {

/// Layers of bricks that a sample is drawn from, where heights of F cost what is made of them.
constexpr std::int64_t layers_of_sample = 3;
/// Bricks of the sides of blocks that a sample is drawn from, where nodes of F cost what is made around them,
/// and of those parts of a block that are tested as a whole.
constexpr std::int64_t bricks_of_block = 8, bricks_of_part = 4;

/// What makes F cheap at many places: whole columns where all heights cost what a few do, a few layers where
/// heights cost what is made of them, and blocks where all nodes do.
enum class SampleOf { columns, layers, blocks };

/// 1 for each brick that the certificate speaks of.
std::vector<std::uint8_t> all_bricks(const MixedVolume& volume, const Certificate& stored);

/// Of the `allowed` bricks a sample, with the brick of the certificate's worst node. Of columns: whole ones,
/// and of each level at least 8 bricks or all. Else bricks of a few layers or blocks, and of each level that
/// is found there at least 8 or all.
std::vector<std::uint8_t> sample_of_bricks(const MixedVolume& volume, const Certificate& stored,
                                           const VerifyOptions& options, SampleOf shape,
                                           std::vector<std::uint8_t> allowed);

}  // namespace vdvr
