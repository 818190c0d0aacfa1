// What stands around the picture of a slice: axes in world units, a scale bar, a colour bar, a caption.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {

struct SliceFrame {
  Grid grid;                           ///< of the volume
  int axis = 2;                        ///< across which the slice lies: 0 x, 1 y, 2 z
  double position = 0;                 ///< world
  std::vector<TransferPoint> colours;  ///< by value, in order, two at least; opacities do not count
  std::string quantity = "density";
  std::string unit;                  ///< of the values, "" where unknown
  std::vector<std::string> caption;  ///< paragraphs below
  int caption_lines = 0;             ///< kept free for them, more are left out; 0: as many as they take
};

/// Where the slice itself lies in a picture of a given size: square pixels, the grid's extent from edge to
/// edge.
struct SlicePlace {
  std::int64_t left = 0, top = 0, width = 0, height = 0;
  bool framed = false;  ///< false: the picture is too small, and the slice is all of it
};
/// A frame takes 20 of the text's sizes across and 18 down at least, the text having a 34th of the picture's
/// shorter side, and 10 pixels.
VDVR_API SlicePlace slice_place(const SliceFrame& frame, std::int64_t width, std::int64_t height);

/// `slice`, drawn for the size that slice_place() says, with its frame around it; not one of its pixels is
/// changed. Axes run as slices do: across z x to the right and y down, across y x right and z down, across x
/// y right and z down. Throws InputError where `slice` has another size.
VDVR_API Image framed_slice(const SliceFrame& frame, const Image& slice, std::int64_t width,
                            std::int64_t height);

/// Black to white over the window.
VDVR_API std::vector<TransferPoint> grey_window(const std::pair<double, double>& window);

}  // namespace vdvr
