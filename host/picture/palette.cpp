#include "host/picture/palette.hpp"

#include <algorithm>
#include <limits>

namespace vdvr {
namespace {

using Colour = std::array<std::uint8_t, 3>;

constexpr std::size_t kColours = 256, kMostPixels = std::size_t{1} << 20;
// Cells of the table of nearest colours: 64 per channel.
constexpr int kCell = 4, kCells = 64;
// The eye sees steps of green first, of blue last.
constexpr std::array<int, 3> kWeight{3, 4, 2};

std::vector<Colour> chosen_pixels(const std::vector<Image>& images) {
  std::size_t total = 0;
  for (const auto& image : images) total += image.rgb.size() / 3;
  // A prime stride does not fall into step with the rows.
  constexpr std::size_t prime = 7919;
  const std::size_t stride = total > kMostPixels ? total / kMostPixels + 1 : 1;
  std::vector<Colour> pixels;
  pixels.reserve(total / stride + 1);
  std::size_t first = 0;
  for (const auto& image : images) {
    const std::size_t n = image.rgb.size() / 3;
    for (std::size_t i = 0, at = first; i < n / stride; ++i, at += stride) {
      const auto* p = &image.rgb[3 * (at % n)];
      pixels.push_back({p[0], p[1], p[2]});
    }
    first += prime;
  }
  if (pixels.empty()) pixels.push_back({images[0].rgb[0], images[0].rgb[1], images[0].rgb[2]});
  return pixels;
}

/// Pixels [first, last) of one box of colours, and its longest side.
struct Box {
  std::size_t first, last;
  std::size_t axis = 0;
  int length = 0;

  /// Boxes with many pixels and wide colours are cut first.
  [[nodiscard]] double worth() const {
    return static_cast<double>(length) * static_cast<double>(length) * static_cast<double>(last - first);
  }
};

Box boxed(const std::vector<Colour>& pixels, std::size_t first, std::size_t last) {
  Box box{first, last};
  for (std::size_t c = 0; c < 3; ++c) {
    int lo = 255, hi = 0;
    for (std::size_t i = first; i < last; ++i) {
      lo = std::min<int>(lo, pixels[i][c]);
      hi = std::max<int>(hi, pixels[i][c]);
    }
    if (const int length = (hi - lo) * kWeight[c]; length > box.length) {
      box.length = length;
      box.axis = c;
    }
  }
  return box;
}

Colour mean(const std::vector<Colour>& pixels, const Box& box) {
  std::array<std::uint64_t, 3> sum{};
  for (std::size_t i = box.first; i < box.last; ++i)
    for (std::size_t c = 0; c < 3; ++c) sum[c] += pixels[i][c];
  const std::uint64_t n = box.last - box.first;
  Colour out{};
  for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<std::uint8_t>((sum[c] + n / 2) / n);
  return out;
}

int distance(const Colour& a, const std::array<int, 3>& b) {
  int d = 0;
  for (std::size_t c = 0; c < 3; ++c) d += kWeight[c] * (a[c] - b[c]) * (a[c] - b[c]);
  return d;
}

std::vector<std::uint8_t> nearest_table(const std::vector<Colour>& colours) {
  std::vector<std::uint8_t> table;
  table.reserve(static_cast<std::size_t>(kCells * kCells * kCells));
  for (int r = 0; r < kCells; ++r)
    for (int g = 0; g < kCells; ++g)
      for (int b = 0; b < kCells; ++b) {
        const std::array<int, 3> middle{r * kCell + kCell / 2, g * kCell + kCell / 2, b * kCell + kCell / 2};
        int best = std::numeric_limits<int>::max();
        std::size_t index = 0;
        for (std::size_t i = 0; i < colours.size(); ++i)
          if (const int d = distance(colours[i], middle); d < best) {
            best = d;
            index = i;
          }
        table.push_back(static_cast<std::uint8_t>(index));
      }
  return table;
}

/// Entry (x, y) of the 8 x 8 Bayer matrix, 0 to 63: the bits of x ^ y and y interleaved, lowest first.
int bayer(std::int64_t x, std::int64_t y) {
  int v = 0;
  for (int bit = 0; bit < 3; ++bit)
    v = v << 2 | static_cast<int>(((x ^ y) >> bit & 1) << 1) | static_cast<int>(y >> bit & 1);
  return v;
}

}  // namespace

Palette palette_of(const std::vector<Image>& images) {
  std::vector<Colour> pixels = chosen_pixels(images);
  std::vector<Box> boxes{boxed(pixels, 0, pixels.size())};
  while (boxes.size() < kColours) {
    const auto widest = std::max_element(boxes.begin(), boxes.end(),
                                         [](const Box& a, const Box& b) { return a.worth() < b.worth(); });
    if (widest->length == 0) break;
    const Box box = *widest;
    const auto begin = pixels.begin() + static_cast<std::ptrdiff_t>(box.first);
    const auto end = pixels.begin() + static_cast<std::ptrdiff_t>(box.last);
    const auto by_axis = [&](const Colour& a, const Colour& b) { return a[box.axis] < b[box.axis]; };
    std::nth_element(begin, begin + (end - begin) / 2, end, by_axis);
    // Cut at the mean of the channel where the median would leave one side without colours of its own.
    const int value = (*(begin + (end - begin) / 2))[box.axis];
    auto cut = std::partition(begin, end, [&](const Colour& p) { return p[box.axis] < value; });
    if (cut == begin) cut = std::partition(begin, end, [&](const Colour& p) { return p[box.axis] <= value; });
    const std::size_t middle = box.first + static_cast<std::size_t>(cut - begin);
    *widest = boxed(pixels, box.first, middle);
    boxes.push_back(boxed(pixels, middle, box.last));
  }
  Palette palette;
  for (const auto& box : boxes) palette.colours.push_back(mean(pixels, box));
  palette.nearest = nearest_table(palette.colours);
  return palette;
}

std::vector<std::uint8_t> dithered(const Palette& palette, const Image& image) {
  std::vector<std::uint8_t> out;
  out.reserve(image.rgb.size() / 3);
  std::size_t i = 0;
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x, i += 3) {
      // Half a step of the palette's usual spacing, about eight levels, to each side.
      const int shift = (bayer(x, y) - 32) / 8;
      std::size_t cell = 0;
      for (std::size_t c = 0; c < 3; ++c)
        cell = cell * kCells + static_cast<std::size_t>(std::clamp(image.rgb[i + c] + shift, 0, 255) / kCell);
      out.push_back(palette.nearest[cell]);
    }
  return out;
}

}  // namespace vdvr
