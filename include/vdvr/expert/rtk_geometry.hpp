// RTK's ThreeDCircularGeometry: the parameters of a view's matrix, and its XML file (docs/inputs.md, "Cone
// beam").
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/cone_geometry.hpp"

namespace vdvr {

/// Where a stack of projections has its pixels: column i lies at origin[0] + i spacing[0], row j at
/// origin[1] + j spacing[1].
struct StackPlace {
  std::array<double, 2> origin{0, 0}, spacing{1, 1};
};

/// What circular_view makes `matrix` of, on a detector of that pitch, `center` and `row` (pixels that a
/// detector without offset shows in the normal from source to isocentre). A matrix tells the detector's
/// distance only by the pitch. Throws InputError where no parameters give the matrix back within 1e-9: rows
/// and columns that are skew or mirrored, pixels of another shape.
VDVR_API CircularView circular_parameters(const ViewMatrix& matrix, double pitch_u, double pitch_v,
                                          double center, double row);

/// Column and row 0 of the detector's middle lie at 0.
VDVR_API StackPlace centred_stack(std::int64_t columns, std::int64_t rows, double pitch_u, double pitch_v);

/// The file's text, version 3, for a stack of that place. Throws InputError, which names the view, as
/// circular_parameters.
VDVR_API std::string rtk_geometry_text(const ConeGeometry& cone, const StackPlace& stack);

}  // namespace vdvr
