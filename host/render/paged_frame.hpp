// Frames of volumes that are brought to the device by bricks: which bricks the rays of a part of the picture
// may read, and parts small enough that theirs fit. Called by: renderer.cpp.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "host/render/raycast.hpp"
#include "host/sampler/paged_volume.hpp"

namespace vdvr {

DrawnField drawn_field(const PagedVolume& volume);
/// Always `buffer`. Throws ResourceError for image3d: the positions of samples in an atlas have the rounding
/// of their coordinates there, so that other tiles beside them would change bits.
std::pair<SamplerKind, std::string> choose_sampler(SamplerKind asked);
/// Whether GradientKind::automatic takes stored gradients: what a device of which half is free
/// would do for the whole volume.
bool stored_would_fit(const PagedVolume& volume);
/// Draws part after part, and waits for each: bricks of the next take the place of those before. `frame` is
/// of the volume's drawn_field(). `rows`: draws no others. Throws as Renderer::render, and ResourceError
/// where the bricks of a few pixels do not fit.
Enqueued enqueue_frame(Frame& frame, Device& device, const PagedVolume& volume, const RenderOptions& options,
                       const RaycastTuning& tuning = {}, std::optional<Rows> rows = std::nullopt);

}  // namespace vdvr
