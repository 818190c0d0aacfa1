// NumPy files, moving pictures, and what is drawn over a picture.
#define BOOST_TEST_MODULE image
#include "vdvr/expert/image.hpp"

#include <gif_lib.h>

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <set>

#include "host/base/system/png.hpp"
#include "host/picture/palette.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/animation.hpp"
#include "vdvr/expert/decorate.hpp"

using namespace vdvr;
using support::TemporaryFolder;

namespace {

Image plain(std::int64_t width, std::int64_t height, std::uint8_t grey) {
  return {width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * width * height), grey)};
}

/// Smooth in all channels, of more colours than a palette has.
Image gradient(std::int64_t side, int shift) {
  Image image = plain(side, side, 0);
  for (std::int64_t y = 0; y < side; ++y)
    for (std::int64_t x = 0; x < side; ++x) {
      auto* p = &image.rgb[static_cast<std::size_t>(3 * (y * side + x))];
      p[0] = static_cast<std::uint8_t>(x * 255 / side);
      p[1] = static_cast<std::uint8_t>(y * 255 / side);
      p[2] = static_cast<std::uint8_t>((x + y + shift) * 127 / side % 256);
    }
  return image;
}

std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
  std::uint32_t v = 0;
  for (std::size_t i = 0; i < 4; ++i) v = v << 8 | static_cast<unsigned char>(bytes[at + i]);
  return v;
}

struct Chunk {
  std::string type, data;
};
std::vector<Chunk> chunks_of(const std::string& png) {
  std::vector<Chunk> chunks;
  for (std::size_t at = 8; at < png.size();) {
    const std::uint32_t length = big_endian(png, at);
    chunks.push_back({png.substr(at + 4, 4), png.substr(at + 8, length)});
    at += 12 + length;
  }
  return chunks;
}

std::size_t changed_pixels(const Image& a, const Image& b) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3)
    if (std::memcmp(&a.rgb[i], &b.rgb[i], 3) != 0) ++n;
  return n;
}

bool is_changed(const Image& a, const Image& b, std::int64_t x, std::int64_t y) {
  const auto i = static_cast<std::size_t>(3 * (y * a.width + x));
  return std::memcmp(&a.rgb[i], &b.rgb[i], 3) != 0;
}

}  // namespace

BOOST_AUTO_TEST_CASE(npy_is_numpy_format_1_0_in_little_endian_floats) {
  const TemporaryFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  write_npy(folder / "v.npy", {3, 2, {0, 1, -2.5f, nan, 1e30f, 0x1p-149f}});
  const std::string bytes = support::bytes_of(folder / "v.npy");
  BOOST_TEST(bytes.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
  const auto length = static_cast<std::size_t>(static_cast<unsigned char>(bytes[8]) +
                                               256 * static_cast<unsigned char>(bytes[9]));
  BOOST_TEST((10 + length) % 64 == 0);
  const std::string header = bytes.substr(10, length);
  BOOST_TEST(header.back() == '\n');
  BOOST_TEST(header.find("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }") == 0);
  BOOST_REQUIRE(bytes.size() == 10 + length + 24);
  // -2.5 is 0xC0200000.
  BOOST_TEST(bytes.substr(10 + length + 8, 4) == std::string("\x00\x00\x20\xC0", 4));
  write_npy(folder / "n.npy", {1, 2, {1, 2, 3, 4, 5, 6}, 3});
  BOOST_TEST(support::bytes_of(folder / "n.npy").find("'shape': (2, 1, 3), }") != std::string::npos);
  BOOST_CHECK_THROW(write_npy(folder / "w.npy", {3, 2, {0}}), InputError);
  BOOST_TEST(!std::filesystem::exists(folder / "w.npy"));
}

BOOST_AUTO_TEST_CASE(apng_holds_every_frame_as_it_is) {
  const TemporaryFolder folder;
  const std::vector<Image> frames{gradient(20, 0), gradient(20, 7), gradient(20, 14)};
  write_apng(folder / "t.apng", frames, 40);
  const auto chunks = chunks_of(support::bytes_of(folder / "t.apng"));
  std::vector<std::string> types;
  for (const auto& c : chunks) types.push_back(c.type);
  BOOST_TEST(types == std::vector<std::string>(
                          {"IHDR", "acTL", "fcTL", "IDAT", "fcTL", "fdAT", "fcTL", "fdAT", "IEND"}));
  BOOST_TEST(big_endian(chunks[1].data, 0) == 3u);
  // Sequence numbers run through fcTL and fdAT.
  BOOST_TEST(big_endian(chunks[2].data, 0) == 0u);
  BOOST_TEST(big_endian(chunks[4].data, 0) == 1u);
  BOOST_TEST(big_endian(chunks[5].data, 0) == 2u);
  BOOST_TEST(big_endian(chunks[7].data, 0) == 4u);
  for (std::size_t f = 0; f < 3; ++f)
    for (const auto& c : chunks_of(encode_png("frame", frames[f])))
      if (c.type == "IDAT")
        BOOST_TEST((f == 0 ? chunks[3].data : chunks[3 + 2 * f].data.substr(4)) == c.data);
}

BOOST_AUTO_TEST_CASE(gif_is_read_back_close_to_the_frames) {
  const TemporaryFolder folder;
  const std::vector<Image> frames{gradient(64, 0), gradient(64, 20)};
  write_gif(folder / "t.gif", frames, 50);
  int error = 0;
  GifFileType* gif = DGifOpenFileName((folder / "t.gif").c_str(), &error);
  BOOST_REQUIRE(gif != nullptr);
  BOOST_REQUIRE(DGifSlurp(gif) == GIF_OK);
  BOOST_REQUIRE(gif->ImageCount == 2);
  for (int f = 0; f < 2; ++f) {
    const SavedImage& saved = gif->SavedImages[f];
    GraphicsControlBlock control{};
    BOOST_REQUIRE(DGifSavedExtensionToGCB(gif, f, &control) == GIF_OK);
    BOOST_TEST(control.DelayTime == 5);
    double sum = 0;
    const auto& rgb = frames[static_cast<std::size_t>(f)].rgb;
    for (std::size_t i = 0; i < rgb.size(); i += 3) {
      const GifColorType& c = gif->SColorMap->Colors[saved.RasterBits[i / 3]];
      sum += std::abs(c.Red - rgb[i]) + std::abs(c.Green - rgb[i + 1]) + std::abs(c.Blue - rgb[i + 2]);
    }
    // 256 colours cut a cube of 255 levels a side into cells of 40; the mean distance to a cell's middle is a
    // quarter of that, and these pictures fill only part of the cube.
    BOOST_TEST(sum / static_cast<double>(rgb.size()) < 10);
  }
  DGifCloseFile(gif, nullptr);
}

BOOST_AUTO_TEST_CASE(few_colours_keep_their_own_entries) {
  Image image = plain(16, 16, 0);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<std::uint8_t>(i / 3 % 4 * 80);
  const Palette palette = palette_of({image});
  const std::set<std::array<std::uint8_t, 3>> colours(palette.colours.begin(), palette.colours.end());
  BOOST_TEST(colours.size() == 4u);
  for (int grey : {0, 80, 160, 240}) {
    const auto g = static_cast<std::uint8_t>(grey);
    BOOST_TEST(colours.count({g, g, g}) == 1u);
  }
}

BOOST_AUTO_TEST_CASE(unequal_frames_and_useless_times_are_refused) {
  const TemporaryFolder folder;
  BOOST_CHECK_THROW(write_gif(folder / "t.gif", {}, 50), InputError);
  BOOST_CHECK_THROW(write_apng(folder / "t.apng", {plain(2, 2, 0), plain(3, 2, 0)}, 50), InputError);
  BOOST_CHECK_THROW(write_apng(folder / "t.apng", {plain(2, 2, 0)}, 0), InputError);
  BOOST_CHECK_THROW(write_gif(folder / "no/t.gif", {plain(2, 2, 0)}, 50), FileError);
  BOOST_TEST(std::filesystem::is_empty(folder.path()));
}

BOOST_AUTO_TEST_CASE(box_edges_go_through_the_projected_corners) {
  const Grid grid = fields::centred_grid({8, 8, 8});
  const Camera camera = orbit_camera(grid, 0, 0, 1);
  const Image before = plain(201, 201, 10);
  Image image = before;
  draw_box(image, camera, grid, std::vector<float>(201 * 201, 1.0f));
  // The eye stands on +y at distance d: the face y = 4 spans 4 / (d - 4) of the tangent to each side.
  const double d = camera.position[1], tangent = std::tan(15 * M_PI / 180);
  const auto corner = static_cast<std::int64_t>(100.5 - 100.5 * 4 / ((d - 4) * tangent));
  BOOST_TEST(is_changed(image, before, corner, 100));
  BOOST_TEST(is_changed(image, before, 100, corner));
  // The face behind is smaller; it is hidden by what is opaque, and shows through what is not.
  const auto behind = static_cast<std::int64_t>(100.5 - 100.5 * 4 / ((d + 4) * tangent));
  BOOST_TEST(!is_changed(image, before, behind, 100));
  draw_box(image, camera, grid, std::vector<float>(201 * 201, 0.0f));
  BOOST_TEST(is_changed(image, before, behind, 100));
}

BOOST_AUTO_TEST_CASE(box_around_the_eye_is_drawn_without_what_lies_behind_it) {
  const Grid grid = fields::centred_grid({8, 8, 8});
  Image image = plain(101, 101, 10);
  draw_box(image, look_at({0, 0, 0}, {0, -1, 0}, std::nullopt, 100), grid,
           std::vector<float>(101 * 101, 0.0f));
  BOOST_TEST(changed_pixels(image, plain(101, 101, 10)) > 0u);
}

BOOST_AUTO_TEST_CASE(axes_point_where_the_camera_sees_them) {
  const Grid grid = fields::centred_grid({8, 8, 8});
  const Image before = plain(400, 400, 0);
  Image image = before;
  draw_axes(image, orbit_camera(grid, 0, 0, 1), 0);
  // Azimuth 0: x to the right in red, z down in blue, from a foot 47 = 28 + 1.6 times 12 pixels inside the
  // corner.
  const auto at = [&](std::int64_t x, std::int64_t y) {
    return &image.rgb[static_cast<std::size_t>(3 * (y * 400 + x))];
  };
  BOOST_TEST(at(57, 352)[0] > at(57, 352)[2]);
  BOOST_TEST(at(47, 362)[2] > at(47, 362)[0]);
}

BOOST_AUTO_TEST_CASE(a_long_caption_leaves_the_picture_to_be_seen) {
  Image brief = plain(512, 512, 60), wordy = brief;
  // One line: capitals of 11 pixels between margins of 9.
  BOOST_TEST(draw_caption(brief, {"a caption"}) == 11 + 2 * 9);
  BOOST_TEST(draw_caption(wordy, {std::string(70, 'x'), std::string(84, 'y') + " " + std::string(40, 'z')}) <=
             512 / 8);
}

BOOST_AUTO_TEST_CASE(colour_bar_and_caption_stay_within_the_picture_at_any_size) {
  const ColourBar bar{{{-1, {0, 0, 0}, 0}, {3, {1, 0, 0}, 0.5}}, true, "1/mm"};
  for (const std::int64_t side : {1, 20, 100, 640}) {
    Image image = plain(side, side, 60);
    const std::int64_t above = draw_caption(image, {"a caption of several words", "and a second paragraph"});
    draw_colour_bar(image, bar, above);
    draw_axes(image, orbit_camera(fields::centred_grid({2, 2, 2}), 0, 0, 1), above);
    BOOST_TEST(image.rgb.size() == static_cast<std::size_t>(3 * side * side));
  }
}
