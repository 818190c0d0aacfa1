// Views that suit a volume: its materials parted, the certified sampler taken.
#define BOOST_TEST_MODULE automatic_view
#include <algorithm>
#include <boost/test/unit_test.hpp>

#include "vdvr/automatic_view.hpp"

using namespace vdvr;

namespace {

constexpr double kBackground = 0.1, kSoft = 0.4, kDense = 1.0;
constexpr std::int64_t kCells = 15;

/// Background, a block of soft material and in the corner of high coordinates a dense one, of an eighth of
/// all: Otsu's criterion parts materials by their amount too.
MixedVolume three_materials() {
  Volume volume{{{kCells, kCells, kCells}, {0, 0, 0}, {1, 1, 1}, "pixel"}, {}};
  for (std::int64_t z = 0; z <= kCells; ++z)
    for (std::int64_t y = 0; y <= kCells; ++y)
      for (std::int64_t x = 0; x <= kCells; ++x) {
        const bool soft = x > 4 && y > 4 && z > 4, dense = x > 7 && y > 7 && z > 7;
        volume.samples.push_back(static_cast<float>(dense ? kDense : soft ? kSoft : kBackground));
      }
  return as_mixed(volume);
}

Certificate holding(std::optional<bool> image3d) {
  Certificate c;
  c.holds_buffer = true;
  c.holds_image3d = image3d;
  return c;
}

/// 0 outside of a cube of 7 samples a side, in it `inside(x)`.
template <class Of>
MixedVolume cube(Of&& inside, float outside = 0) {
  Volume volume{{{kCells, kCells, kCells}, {0, 0, 0}, {1, 1, 1}, "pixel"}, {}};
  for (std::int64_t z = 0; z <= kCells; ++z)
    for (std::int64_t y = 0; y <= kCells; ++y)
      for (std::int64_t x = 0; x <= kCells; ++x) {
        const bool in = std::min({x, y, z}) >= 5 && std::max({x, y, z}) <= 11;
        volume.samples.push_back(in ? static_cast<float>(inside(x)) : outside);
      }
  return as_mixed(volume);
}

double opacity(const MixedVolume& volume, double value) {
  return transfer_at(automatic_view(volume).transfer.points, value).opacity;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_mask_is_opaque_and_what_lies_around_is_not) {
  for (const double value : {1.0, 255.0, 1e-6, 1e20}) {
    const MixedVolume mask = cube([&](std::int64_t) { return value; });
    const Brightness b = brightness_of(mask);
    BOOST_TEST(b.lo == 0);
    BOOST_TEST(b.grey_lo == 0);
    BOOST_TEST(b.hi == static_cast<double>(static_cast<float>(value)));
    BOOST_TEST(b.grey_hi == b.hi);
    BOOST_TEST(b.threshold == b.hi / 2);
    for (const double c : b.dense_center) BOOST_TEST(c == 8);
    BOOST_TEST(opacity(mask, 0) == 0);
    BOOST_TEST(opacity(mask, b.hi) > 0.5);
  }
}

BOOST_AUTO_TEST_CASE(every_label_shows_whatever_lies_around) {
  for (const float outside : {0.0f, -1000.0f, 7.0f}) {
    // 3 labels above what is outside, the least of them the commonest.
    const MixedVolume labels =
        cube([&](std::int64_t x) { return outside + (x < 9    ? 1
                                                     : x < 10 ? 2
                                                              : 60); }, outside);
    BOOST_TEST(opacity(labels, outside) == 0);
    for (const double label : {1, 2, 60})
      BOOST_TEST(opacity(labels, static_cast<double>(outside) + label) > 0);
    const Brightness b = brightness_of(labels);
    BOOST_TEST(b.soft == static_cast<double>(outside) + 0.5);
    BOOST_TEST(b.threshold == static_cast<double>(outside) + 31);
  }
}

BOOST_AUTO_TEST_CASE(an_object_below_what_lies_around_shows_too) {
  const MixedVolume below = cube([](std::int64_t) { return -1; });
  const Brightness b = brightness_of(below);
  BOOST_TEST(b.dense_is_low);
  BOOST_TEST(b.threshold == -0.5);
  BOOST_TEST(opacity(below, -1) > 0.5);
  BOOST_TEST(opacity(below, 0) == 0);
  for (const double c : b.dense_center) BOOST_TEST(c == 8);
}

BOOST_AUTO_TEST_CASE(an_outlier_does_not_hide_the_rest) {
  std::uint32_t state = 1;
  const auto noise = [&] {
    return static_cast<double>((state = state * 1664525 + 1013904223) >> 8) * 0x1p-24;
  };
  MixedVolume hot = cube([&](std::int64_t) { return 1 + 0.1 * noise(); });
  for (float& s : hot.base.f32)
    if (s == 0) s = static_cast<float>(0.1 * noise());
  hot.base.f32[0] = 1e9f;
  const Brightness b = brightness_of(hot);
  BOOST_TEST(b.threshold > 0.05);  // above most of what lies around
  BOOST_TEST(b.threshold < 1);
  BOOST_TEST(b.hi < 2);
  BOOST_TEST(opacity(hot, 1.05) > 0);
}

BOOST_AUTO_TEST_CASE(a_constant_has_a_view) {
  for (const double value : {0.0, 7.0}) {
    const MixedVolume constant = cube([&](std::int64_t) { return value; }, static_cast<float>(value));
    const RenderOptions view = automatic_view(constant);
    for (const TransferPoint& p : view.transfer.points) BOOST_TEST(p.value == value);
  }
}

BOOST_AUTO_TEST_CASE(thresholds_lie_between_materials) {
  const Brightness b = brightness_of(three_materials());
  BOOST_TEST(b.threshold > kSoft);
  BOOST_TEST(b.threshold < kDense);
  BOOST_TEST(b.soft > kBackground);
  BOOST_TEST(b.soft < kSoft);
  for (const double c : b.dense_center) BOOST_TEST(c == 11.5);  // the middle of samples 8 to 15
}

BOOST_AUTO_TEST_CASE(background_is_clear_and_the_dense_material_is_not) {
  const RenderOptions view = automatic_view(three_materials());
  BOOST_TEST(transfer_at(view.transfer.points, kBackground).opacity == 0);
  BOOST_TEST(transfer_at(view.transfer.points, kDense).opacity >
             transfer_at(view.transfer.points, kSoft).opacity);
  BOOST_REQUIRE(view.surfaces.size() == 1);
  BOOST_TEST(view.surfaces[0].value > kSoft);
  BOOST_TEST(*view.slice_position == 11.5);
}

BOOST_AUTO_TEST_CASE(a_view_of_a_certified_volume_takes_the_buffer_which_holds_on_every_device) {
  using enum SamplerKind;
  BOOST_CHECK(automatic_view(three_materials()).sampler == automatic);
  for (const std::optional<bool> image3d : {std::optional<bool>(), std::optional(false), std::optional(true)})
    BOOST_CHECK(automatic_view(three_materials(), holding(image3d)).sampler == buffer);
}

BOOST_AUTO_TEST_CASE(a_volume_of_a_cell_in_z_is_thin) {
  BOOST_TEST(is_thin({{64, 64, 1}, {0, 0, 0}, {1, 1, 1}, "pixel"}));
  BOOST_TEST(!is_thin({{64, 64, 64}, {0, 0, 0}, {1, 1, 1}, "pixel"}));
}
