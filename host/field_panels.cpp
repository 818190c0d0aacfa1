#include "host/field_panels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/picture/bitmap_font.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using Colour = std::array<std::uint8_t, 3>;
constexpr Colour kInk{20, 20, 20}, kNothing{120, 160, 120};
constexpr int kText = 2;
constexpr std::int64_t kGlyph = kFontAdvance * kText, kLine = kFontHeight * kText + 8, kGap = 12, kBar = 18;
constexpr std::int64_t kBarText = 8 * kGlyph;

Image blank(std::int64_t width, std::int64_t height) {
  return {width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width * height * 3), 255)};
}
void put(Image& image, std::int64_t x, std::int64_t y, const Colour& c) {
  std::copy(c.begin(), c.end(), image.rgb.begin() + (y * image.width + x) * 3);
}
void text(Image& image, std::int64_t x, std::int64_t y, const std::string& s) {
  draw_text(image, x, y, s, kText, kInk);
}
/// As many characters as fit over a panel.
std::string fitting(const std::string& s, std::int64_t width) {
  return s.substr(0, static_cast<std::size_t>(std::max<std::int64_t>(0, width / kGlyph)));
}

Colour colour_of(double fraction, PanelColours colours) {
  if (colours == PanelColours::heat) return figure::colour(fraction);
  const auto g = static_cast<std::uint8_t>(std::lround(255 * fraction));
  return {g, g, g};
}

void draw_scale(Image& image, std::int64_t x, std::int64_t y, std::int64_t height, const figure::Scale& scale,
                PanelColours colours) {
  for (std::int64_t j = 0; j < height; ++j)
    for (std::int64_t i = 0; i < kBar; ++i)
      put(image, x + i, y + j,
          colour_of(1 - static_cast<double>(j) / static_cast<double>(std::max<std::int64_t>(1, height - 1)),
                    colours));
  for (const double f : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const auto at = y + std::lround((1 - f) * static_cast<double>(height - kFontHeight * kText));
    text(image, x + kBar + 6, at, fmt::format("{:.3g}", scale.value(f)));
  }
}

template <class Panel>
void check_sizes(const std::vector<Panel>& panels, std::int64_t width, std::int64_t height) {
  for (const auto& p : panels)
    if (p.width != width || p.height != height || width < 1 || height < 1)
      throw InputError(fmt::format("panels of {} x {} and {} x {} cannot stand in one figure", width, height,
                                   p.width, p.height));
}

}  // namespace

Image field_panels(const std::vector<FieldPanel>& panels, const figure::Scale& scale, PanelColours colours,
                   const std::string& caption) {
  if (panels.empty()) throw InputError("a figure needs a panel");
  const std::int64_t width = panels.front().width, height = panels.front().height;
  check_sizes(panels, width, height);
  const auto count = static_cast<std::int64_t>(panels.size());
  Image image = blank(kGap + count * (width + kGap) + kBar + 6 + kBarText, 2 * kGap + 2 * kLine + height);
  const std::int64_t top = kGap + kLine;
  for (std::int64_t p = 0; p < count; ++p) {
    const FieldPanel& panel = panels[static_cast<std::size_t>(p)];
    const std::int64_t left = kGap + p * (width + kGap);
    text(image, left, kGap, fitting(panel.title, width));
    for (std::int64_t y = 0; y < height; ++y)
      for (std::int64_t x = 0; x < width; ++x) {
        const double v = panel.values.at(static_cast<std::size_t>(y * width + x));
        put(image, left + x, top + y, std::isnan(v) ? kNothing : colour_of(scale.fraction(v), colours));
      }
  }
  draw_scale(image, kGap + count * (width + kGap), top, height, scale, colours);
  text(image, kGap, top + height + 6, fitting(caption, image.width - kGap));
  return image;
}

Image titled_pictures(const std::vector<TitledPicture>& pictures, std::size_t across) {
  if (pictures.empty() || across == 0) throw InputError("a figure needs a panel");
  const std::int64_t width = pictures.front().image.width, height = pictures.front().image.height;
  std::vector<Image> images;
  for (const auto& p : pictures) images.push_back(p.image);
  check_sizes(images, width, height);
  const auto columns = static_cast<std::int64_t>(std::min(across, pictures.size()));
  const std::int64_t rows = (static_cast<std::int64_t>(pictures.size()) + columns - 1) / columns;
  Image image = blank(kGap + columns * (width + kGap), kGap + rows * (kLine + height + kGap));
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::int64_t left = kGap + static_cast<std::int64_t>(i) % columns * (width + kGap);
    const std::int64_t top = kGap + static_cast<std::int64_t>(i) / columns * (kLine + height + kGap);
    text(image, left, top, fitting(pictures[i].title, width));
    for (std::int64_t y = 0; y < height; ++y)
      std::copy_n(images[i].rgb.begin() + y * width * 3, width * 3,
                  image.rgb.begin() + ((top + kLine + y) * image.width + left) * 3);
  }
  return image;
}

}  // namespace vdvr
