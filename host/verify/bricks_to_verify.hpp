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

/// 1 for each brick that the certificate speaks of.
std::vector<std::uint8_t> all_bricks(const MixedVolume& volume, const Certificate& stored);

/// Of these a sample, with the brick of the certificate's worst node, and of each level at least 8 bricks or
/// all. Where `all_heights` are as cheap as a few, whole columns of bricks: what is made of F across z then
/// serves all of a column. Else bricks of a few layers.
std::vector<std::uint8_t> sample_of_bricks(const MixedVolume& volume, const Certificate& stored,
                                           const VerifyOptions& options, bool all_heights);

}  // namespace vdvr
