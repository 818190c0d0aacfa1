// The options of `vdvr render`: their declaration, what their words alone decide, and which of them exclude
// each other. Called by commands/render.cpp.
#pragma once

#include <filesystem>
#include <vector>

#include "apps/common/arguments.hpp"
#include "apps/vdvr/view.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {

/// Where the camera stands unless another place is asked for.
inline constexpr Orbit kRenderOrbit{30, 20, 1};

void add_render_options(Arguments& args);

/// What the name of the output asks for.
enum class OutputKind { picture, values, folder, apng, gif };

OutputKind output_kind(const std::filesystem::path& output, bool turntable);

/// One at the threshold, unless others are asked for.
std::vector<IsoSurface> surfaces_for(const Arguments& args, double threshold);

/// Everything that the words alone decide; what depends on the volume is filled in by the command.
RenderOptions render_options(const Arguments& args);

/// What --show says of bricks: bound where it speaks of something else.
BrickQuantity brick_quantity(const Arguments& args);

/// Throws InputError, before anything is read, for options that exclude each other.
void check_combination(const Arguments& args, const RenderOptions& options);

}  // namespace vdvr::cli
