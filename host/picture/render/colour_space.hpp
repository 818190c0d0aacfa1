// Interpolation of colours in the spaces that transfer functions of other programs name: HSV, CIE L*a*b*, and
// Moreland's diverging maps in Msh (polar L*a*b*). Colours are sRGB display values in [0, 1], white point
// D65.
#pragma once

#include <array>

namespace vdvr {

enum class ColourSpace { rgb, hsv, hsv_wrap, lab, diverging, step };

using Rgb = std::array<double, 3>;

/// Coordinates in `space` in which components are interpolated one by one; of `diverging` those of Lab.
Rgb to_space(ColourSpace space, const Rgb& rgb);
/// Back, clamped to [0, 1].
Rgb from_space(ColourSpace space, const Rgb& coordinates);
/// Between two colours, f in [0, 1]; `step`: the second above 0, as in ParaView. `diverging` follows K.
/// Moreland, Diverging Color Maps for Scientific Visualization, 2009.
Rgb mix(ColourSpace space, const Rgb& first, const Rgb& second, double f);

}  // namespace vdvr
