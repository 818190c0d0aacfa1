// Piecewise curves with midpoint and sharpness, as VTK's programs (ParaView, 3D Slicer) store them, turned
// into the straight pieces that our transfer functions have.
#pragma once

#include <vector>

#include "host/picture/render/colour_space.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {

/// `midpoint` and `sharpness` shape the piece from this node to the next: where it is half-way, as a part of
/// the piece, and how abrupt it is (0 straight, 1 nearly a step).
template <class Value>
struct CurveNode {
  double x = 0;
  Value y{};
  double midpoint = 0.5, sharpness = 0;
};
using OpacityNodes = std::vector<CurveNode<double>>;
using ColourNodes = std::vector<CurveNode<Rgb>>;

/// The two curves at every place where one of them bends. Bent pieces are cut into 32 straight ones; two
/// points at one value are a jump. Both lists are in order of x and not empty.
std::vector<TransferPoint> joined(const ColourNodes& colours, const OpacityNodes& opacities,
                                  ColourSpace space);

}  // namespace vdvr
