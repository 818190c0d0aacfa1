// Letters, round numbers along axes, and what stands around a slice.
#define BOOST_TEST_MODULE text
#include "host/picture/text.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>

#include "host/picture/canvas.hpp"
#include "host/picture/ticks.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/slice_frame.hpp"

using namespace vdvr;

namespace {

constexpr Colour kWhite{255, 255, 255}, kBlack{0, 0, 0};

struct Box {
  std::int64_t left = 1 << 20, top = 1 << 20, right = -1, bottom = -1;
};
/// Where anything was drawn on white.
Box inked(const Image& image) {
  Box box;
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x)
      if (image.rgb[static_cast<std::size_t>(3 * (y * image.width + x))] != 255)
        box = {std::min(box.left, x), std::min(box.top, y), std::max(box.right, x), std::max(box.bottom, y)};
  return box;
}

Image written(const std::string& text, double size) {
  Image image = blank(400, 80, kWhite);
  draw_text(image, 20, 30, text, size, kBlack);
  return image;
}

Grid grid_of(Index3 cells, Vec3 spacing, Vec3 origin, std::string unit) {
  Grid g;
  g.cells = cells;
  g.spacing = spacing;
  g.origin = origin;
  g.unit = std::move(unit);
  return g;
}

SliceFrame frame_of(const Grid& grid, int axis) {
  SliceFrame f;
  f.grid = grid;
  f.axis = axis;
  f.position = grid.origin[static_cast<std::size_t>(axis)];
  f.colours = grey_window({-0.002, 0.05});
  f.unit = "mm⁻¹";
  f.caption = {"|V − F| ≤ 0.004 mm⁻¹ at every covered point", "a_name_" + std::string(300, 'x')};
  return f;
}

}  // namespace

BOOST_AUTO_TEST_CASE(capitals_stand_between_their_top_and_their_base) {
  for (const double size : {10.0, 15.0, 32.0}) {
    const Box box = inked(written("HEH", size));
    // A row more for strokes that do not end on whole pixels.
    BOOST_TEST(std::abs(static_cast<double>(box.top) - 30) <= 1);
    BOOST_TEST(std::abs(static_cast<double>(box.bottom) - (29 + cap_height(size))) <= 1);
  }
}

BOOST_AUTO_TEST_CASE(widths_are_those_of_what_is_drawn) {
  for (const char* text : {"density (mm⁻¹)", "AVAVA", "|V − F| ≤ 3.5 × 10⁻⁶ µm", "W"}) {
    const double size = 20, width = text_width(text, size);
    const Box box = inked(written(text, size));
    // Bearings on either side are a fifth of the em at most.
    BOOST_TEST(box.left >= 20 - size / 5);
    BOOST_TEST(static_cast<double>(box.right) <= 20 + width + size / 5);
    BOOST_TEST(static_cast<double>(box.right - box.left) >= 0.7 * width);
  }
  BOOST_TEST(text_width("AV", 100) < text_width("A", 100) + text_width("V", 100));  // kerned
  BOOST_TEST(text_width("", 20) == 0);
}

BOOST_AUTO_TEST_CASE(one_text_has_the_same_bits_everywhere) {
  const Image image = written("Ωµ °C: 1.5 × 10⁻³ ≤ ε", 17);
  BOOST_TEST(sha256_of_text(std::string(image.rgb.begin(), image.rgb.end())) ==
             "e70cbbc5094f288554465fea6000560ef88e875e093eb0abc7538e8cfd090de6");
}

BOOST_AUTO_TEST_CASE(what_is_no_text_is_drawn_all_the_same) {
  for (const std::string& text :
       {std::string("\xff\xfe"), std::string("a\xc3"), std::string("\xed\xa0\x80"), std::string("a\0b", 3),
        std::string("\xf4\x90\x80\x80"), std::string("\xc0\xaf")}) {
    const Box box = inked(written(text, 16));
    BOOST_TEST(box.right > box.left);
  }
  BOOST_TEST(text_width("\xff", 20) == text_width("\xef\xbf\xbd", 20));  // U+FFFD
  Image small = blank(3, 2, kWhite);
  draw_text(small, -50, -7, "far outside, and across", 30, kBlack);
  draw_text_upwards(small, -5, 40, "far outside, and across", 30, kBlack);
  draw_text(small, 1e9, 1e9, "nowhere", 30, kBlack);
}

BOOST_AUTO_TEST_CASE(upright_text_is_the_same_text_turned) {
  const Image flat = written("z (mm)", 16);
  Image upright = blank(80, 400, kWhite);
  draw_text_upwards(upright, 30, 380, "z (mm)", 16, kBlack);
  for (std::int64_t y = 0; y < 80; ++y)
    for (std::int64_t x = 0; x < 400; ++x)
      BOOST_REQUIRE(flat.rgb[static_cast<std::size_t>(3 * (y * 400 + x))] ==
                    upright.rgb[static_cast<std::size_t>(3 * ((399 - x) * 80 + y))]);
}

BOOST_AUTO_TEST_CASE(long_texts_end_in_an_ellipsis_and_lines_fit) {
  const std::string name = "µµµµ_a_very_long_name_of_a_file_that_nobody_asked_for.h5";
  for (const double width : {15.0, 60.0, 200.0, 1000.0}) {
    const std::string shown = fitted(name, width, 14);
    BOOST_TEST(text_width(shown, 14) <= width);
    BOOST_TEST((shown == name) == (text_width(name, 14) <= width));
    if (shown != name && !shown.empty()) BOOST_TEST(shown.ends_with("…"));
    for (const std::string& line : wrapped({"words that wrap " + name + " and more words", "one"}, width, 14))
      BOOST_TEST(text_width(line, 14) <= width);
  }
}

BOOST_AUTO_TEST_CASE(ticks_are_round_few_and_told_apart) {
  for (int decade = -20; decade <= 20; ++decade)
    for (const double low : {-7.3, -1.0, 0.0, 0.37, 99.0})
      for (const double span : {0.013, 1.0, 6.1, 240.0})
        for (const int most : {3, 5, 9}) {
          const double scale = std::pow(10.0, decade), lo = low * scale, hi = (low + span) * scale;
          const Ticks t = round_ticks(lo, hi, most);
          BOOST_REQUIRE(t.ticks.size() >= 2u);
          BOOST_REQUIRE(t.ticks.size() <= static_cast<std::size_t>(most));
          std::set<std::string> labels;
          double before = -std::numeric_limits<double>::infinity();
          for (const Tick& tick : t.ticks) {
            BOOST_REQUIRE((tick.value >= lo && tick.value <= hi && tick.value > before));
            before = tick.value;
            labels.insert(tick.label);
            std::string plain = tick.label;
            if (const auto at = plain.find("−"); at != std::string::npos) plain.replace(at, 3, "-");
            // What is written is what is meant, to the digits written: half a unit of the last is rounding.
            const double said = std::strtod(plain.c_str(), nullptr) * std::pow(10.0, t.exponent);
            BOOST_REQUIRE(std::abs(said - tick.value) <= 0.05 * (hi - lo));
          }
          BOOST_REQUIRE(labels.size() == t.ticks.size());
        }
}

BOOST_AUTO_TEST_CASE(ranges_that_have_no_round_numbers_show_their_ends) {
  BOOST_TEST(round_ticks(3, 3, 5).ticks.size() == 1u);
  BOOST_TEST(round_ticks(1e6, 1e6 + 1e-8, 5).ticks.size() == 1u);
  const Ticks small = round_ticks(-4.1e-7, 4.1e-7, 2);
  BOOST_TEST(small.exponent == -7);
  BOOST_TEST(small.ticks.size() == 2u);
  BOOST_TEST(small.ticks.back().label == "4.1");
  BOOST_TEST(round_ticks(1, 0, 5).ticks.empty());
  BOOST_TEST(round_ticks(0, std::numeric_limits<double>::infinity(), 5).ticks.empty());
  BOOST_TEST(round_ticks(std::nan(""), 1, 5).ticks.empty());
  const Ticks across = round_ticks(-0.5, 0.5, 5);
  for (const Tick& t : across.ticks) BOOST_TEST(t.label != "−0.0");
}

BOOST_AUTO_TEST_CASE(lengths_are_round_and_units_are_read_easily) {
  BOOST_TEST(round_length(73) == 50);
  BOOST_TEST(round_length(50) == 50);
  BOOST_TEST(std::abs(round_length(2.9e-7) - 2e-7) <= tolerance::unit_roundoff * 2e-7);
  BOOST_TEST(shown_unit("m", 3e-8 * 512).name == "µm");
  BOOST_TEST(shown_unit("m", 3e-8).name == "nm");
  BOOST_TEST(shown_unit("mm", 211).name == "mm");
  BOOST_TEST(shown_unit("um", 2500).name == "mm");
  BOOST_TEST(shown_unit("pixel", 1e-9).name == "pixel");
  BOOST_TEST(shown_unit("um", 2500).factor == 1e-3);
  BOOST_TEST(times_power(-12) == "×10⁻¹²");
  BOOST_TEST(times_power(0) == "");
  BOOST_TEST(number_text(-1.2346e10) == "−1.235 ×10¹⁰");
  BOOST_TEST(number_text(0.0456) == "0.0456");
}

BOOST_AUTO_TEST_CASE(a_frame_keeps_every_pixel_of_its_slice_and_draws_around_it) {
  const Grid head = grid_of({96, 96, 60}, {2, 2, 2}, {-96, -96, -60}, "mm"),
             flat = grid_of({593, 593, 1}, {1e-3, 1e-3, 1e-3}, {-0.3, -0.3, 0}, "m"),
             tall = grid_of({8, 8, 900}, {1, 1, 1}, {0, 0, 1e6}, "pixel");
  for (const Grid& grid : {head, flat, tall})
    for (int axis = 0; axis < 3; ++axis)
      for (const auto& [width, height] : {std::pair{512, 512}, {250, 230}, {2048, 700}, {600, 2048}}) {
        const SliceFrame frame = frame_of(grid, axis);
        const SlicePlace p = slice_place(frame, width, height);
        BOOST_REQUIRE(p.framed);
        BOOST_REQUIRE((p.width >= 1 && p.height >= 1 && p.left > 1 && p.top > 1));
        BOOST_REQUIRE((p.left + p.width < width && p.top + p.height < height));
        // Square pixels, to the rounding up of a side.
        const std::size_t a = axis == 0 ? 1 : 0, d = axis == 2 ? 1 : 2;
        const double sides = static_cast<double>(grid.cells[a]) * grid.spacing[a] /
                             (static_cast<double>(grid.cells[d]) * grid.spacing[d]);
        BOOST_TEST(
            (std::abs(static_cast<double>(p.width) - sides * static_cast<double>(p.height)) <= 1 + sides ||
             p.height == 1 || p.width == 1));
        Image slice = blank(p.width, p.height, {200, 10, 90});
        const Image image = framed_slice(frame, slice, width, height);
        BOOST_REQUIRE((image.width == width && image.height == height));
        std::int64_t kept = 0, around = 0, edge = 0;
        for (std::int64_t y = 0; y < height; ++y)
          for (std::int64_t x = 0; x < width; ++x) {
            const auto* c = &image.rgb[static_cast<std::size_t>(3 * (y * width + x))];
            const bool inside = x >= p.left && y >= p.top && x < p.left + p.width && y < p.top + p.height;
            kept += inside && c[0] == 200 && c[1] == 10 && c[2] == 90;
            around += !inside && c[0] < 128;
            edge += (x == 0 || y == 0 || x == width - 1 || y == height - 1) && c[0] != 255;
          }
        BOOST_TEST(kept == p.width * p.height);
        BOOST_TEST(around > 100);
        BOOST_TEST(edge == 0);  // nothing is cut off
      }
}

BOOST_AUTO_TEST_CASE(every_row_and_column_of_the_place_lies_in_the_grid) {
  for (const auto& [x, y] :
       {std::pair<std::int64_t, std::int64_t>{8, 75}, {75, 8}, {1000, 7}, {3, 1000}, {96, 95}})
    for (std::int64_t height = 300; height < 700; height += 17) {
      const Grid grid = grid_of({x, y, 4}, {1, 1, 1}, {0, 0, 0}, "pixel");
      const SlicePlace p = slice_place(frame_of(grid, 2), 512, height);
      // As the slice is drawn: square pixels, centred.
      const double a = static_cast<double>(x), b = static_cast<double>(y), w = static_cast<double>(p.width),
                   h = static_cast<double>(p.height), pixel = std::max(a / w, b / h);
      BOOST_TEST((a / 2 + (0.5 - w / 2) * pixel >= -tolerance::fp64_sum(8, a + b)));
      BOOST_TEST((b / 2 + (0.5 - h / 2) * pixel >= -tolerance::fp64_sum(8, a + b)));
    }
}

BOOST_AUTO_TEST_CASE(absurd_units_and_values_stay_within_the_picture) {
  const Grid grid = grid_of({96, 96, 60}, {1e-3, 1e-3, 1e-3}, {12345678, -96, -60}, std::string(90, 'w'));
  SliceFrame frame = frame_of(grid, 2);
  frame.unit = std::string(300, 'q');
  frame.colours = grey_window({-1.2345e19, 3.3e20});
  const SlicePlace p = slice_place(frame, 512, 512);
  const Image image = framed_slice(frame, blank(p.width, p.height, {90, 90, 90}), 512, 512);
  std::int64_t edge = 0;
  for (std::int64_t i = 0; i < 512; ++i)
    for (const std::int64_t at : {i, 511 * 512 + i, 512 * i, 512 * i + 511})
      edge += image.rgb[static_cast<std::size_t>(3 * at)] != 255;
  BOOST_TEST(edge == 0);
}

BOOST_AUTO_TEST_CASE(a_small_picture_is_the_slice_alone) {
  const SliceFrame frame = frame_of(grid_of({96, 96, 60}, {2, 2, 2}, {-96, -96, -60}, "mm"), 2);
  const SlicePlace p = slice_place(frame, 128, 128);
  BOOST_TEST(!p.framed);
  BOOST_TEST(p.width == 128);
  const Image slice = blank(128, 128, {1, 2, 3});
  BOOST_TEST((framed_slice(frame, slice, 128, 128).rgb == slice.rgb));
  BOOST_CHECK_THROW(framed_slice(frame, blank(5, 5, kWhite), 512, 512), InputError);
}
