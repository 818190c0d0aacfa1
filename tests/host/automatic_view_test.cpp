// Views that suit a volume: its materials parted, the certified sampler taken.
#define BOOST_TEST_MODULE automatic_view
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

}  // namespace

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
