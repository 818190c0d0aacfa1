// Slices of fields or of errors side by side under one colour scale, and pictures side by side with titles.
// Called by the command bench paper.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/picture/figure.hpp"
#include "vdvr/image.hpp"

namespace vdvr {

struct FieldPanel {
  std::string title;
  std::int64_t width = 0, height = 0;
  std::vector<double> values;  ///< [y][x], row 0 on top; NaN is shown as a colour of its own
};
enum class PanelColours { heat, grey };

/// Panels from left to right, all under `scale`, with one bar at the right; a value beyond the scale takes
/// the colour of its end. Throws InputError for panels of different sizes or none.
Image field_panels(const std::vector<FieldPanel>& panels, const figure::Scale& scale, PanelColours colours,
                   const std::string& caption);

struct TitledPicture {
  std::string title;
  Image image;
};
/// Pictures of one size, `across` to a row, each below its title. Throws InputError as above.
Image titled_pictures(const std::vector<TitledPicture>& pictures, std::size_t across);

}  // namespace vdvr
