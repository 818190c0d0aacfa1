// The colours and sizes of sheets: pictures of curves and sinograms on paper.
#pragma once

#include "host/picture/canvas.hpp"

namespace vdvr {

inline constexpr Colour kPaper{255, 255, 255}, kInk{20, 20, 20}, kGrid{215, 215, 215}, kCurve{0, 90, 180};
inline constexpr std::int64_t kEdge = 14;
inline constexpr double kText = 16;

}  // namespace vdvr
