// Pictures by buffer and by image3d, and of samples of all types: how far they may lie apart.
#define BOOST_TEST_MODULE raycast_samplers
#include <boost/test/unit_test.hpp>

#include "host/picture/render/raycast.hpp"
#include "host/volume/sampler/resident_volume.hpp"
#include "tests/support/blob_pictures.hpp"
#include "tests/support/charged.hpp"

using namespace vdvr;
using support::coarse_blob, support::device, support::mixed_blob, support::options_for, support::same_bits,
    support::u;

BOOST_AUTO_TEST_CASE(samplers_agree_within_the_probe) {
  const SamplerProbe probe = probe_sampler(device());
  for (const auto& types :
       {std::vector{SampleType::f32}, std::vector{SampleType::u16}, std::vector{SampleType::u8},
        std::vector{SampleType::u8, SampleType::f32, SampleType::u16}}) {
    const bool one_type = types.size() == 1;
    const ResidentVolume v(device(), support::in_types(one_type ? coarse_blob() : mixed_blob(), types));
    if (!v.has_image3d()) continue;
    for (const RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::slice}) {
      RenderOptions o = options_for(v.grid(), mode);
      o.sampler = SamplerKind::buffer;
      const auto by_buffer = raycast_float(device(), v, o);
      const auto buffer_image = raycast(device(), v, o).image;
      o.sampler = SamplerKind::image3d;
      const auto by_image = raycast_float(device(), v, o);
      const auto image_image = raycast(device(), v, o).image;
      BOOST_TEST((by_image.sampler == SamplerKind::image3d));
      // The field differs by delta per axis and unit difference, plus coordinate rounding in the atlas (2 n
      // 2^-24 texels); neighbours differ by 0.4 at most here, values are at most 1.
      const auto n = static_cast<double>(v.impl().layout.longest());
      const double delta = std::max({probe.delta, probe.u16.delta, probe.u8.delta});
      const double field =
          3 * (delta + 2 * n * u) * 0.4 + 14 * u +
          (probe.largest_constant_error() + 4 * u) * static_cast<double>(v.impl().facts->largest);
      if (mode != RenderMode::dvr)
        for (std::size_t i = 0; i < by_buffer.pixels.size(); ++i)
          BOOST_REQUIRE(!(std::abs(static_cast<double>(by_buffer.pixels[i].s[3]) -
                                   static_cast<double>(by_image.pixels[i].s[3])) > field));
      int levels = 0;
      for (std::size_t i = 0; i < buffer_image.rgb.size(); ++i)
        levels = std::max(levels, std::abs(int{buffer_image.rgb[i]} - int{image_image.rgb[i]}));
      if (delta <= 0x1p-22) BOOST_TEST(levels <= 1);
    }
  }
}

namespace {

/// How far apart, of 255 levels, pictures without light may be of fields that differ by `error` at most: what
/// is seen is a mean of colours, so that it changes by their change and by that of all opacities. A base cell
/// absorbs per unit of value at most the opacity's slope over what the densest cell lets through.
double picture_change(const TransferFunction& transfer, const Grid& grid, double error) {
  double colour = 0, opacity = 0, densest = 0, path = 0;
  for (std::size_t i = 1; i < transfer.points.size(); ++i) {
    const TransferPoint &a = transfer.points[i - 1], &b = transfer.points[i];
    if (!(b.value > a.value)) continue;
    for (std::size_t c = 0; c < 3; ++c)
      colour = std::max(colour, std::abs(b.rgb[c] - a.rgb[c]) / (b.value - a.value));
    opacity = std::max(opacity, std::abs(b.opacity - a.opacity) / (b.value - a.value));
    densest = std::max({densest, a.opacity, b.opacity});
  }
  for (const std::int64_t cells : grid.cells) path += static_cast<double>(cells * cells);
  return 255 * error * (colour + std::sqrt(path) * opacity / (1 - densest));
}

}  // namespace

BOOST_AUTO_TEST_CASE(samplers_agree_in_every_way_of_stepping_and_shading) {
  for (const MixedVolume& field : {mixed_blob(), coarse_blob()}) {
    const ResidentVolume v(device(), field);
    if (!v.has_image3d()) return;
    const auto differs = [&](auto&& change) {
      RenderOptions o = options_for(v.grid(), RenderMode::dvr);
      change(o);
      o.sampler = SamplerKind::buffer;
      const auto by_buffer = raycast(device(), v, o).image;
      o.sampler = SamplerKind::image3d;
      const auto by_image = raycast(device(), v, o).image;
      int most = 0;
      for (std::size_t i = 0; i < by_buffer.rgb.size(); ++i)
        most = std::max(most, std::abs(int{by_buffer.rgb[i]} - int{by_image.rgb[i]}));
      return most;
    };
    const double charged = support::charged_between_samplers(field);
    const auto slice_by = [&](SamplerKind sampler) {
      RenderOptions o = options_for(v.grid(), RenderMode::slice);
      o.sampler = sampler;
      return raycast_float(device(), v, o).pixels;
    };
    const auto by_buffer = slice_by(SamplerKind::buffer), by_image = slice_by(SamplerKind::image3d);
    for (std::size_t i = 0; i < by_buffer.size(); ++i) {
      const auto a = static_cast<double>(by_buffer[i].s[3]), b = static_cast<double>(by_image[i].s[3]);
      BOOST_REQUIRE(std::isnan(a) == std::isnan(b));
      BOOST_REQUIRE(!(std::abs(a - b) > charged));
    }
    // Softly, so that the bound says something, and without light, whose gradients are quotients of what the
    // filter errs and half a cell.
    const TransferFunction soft{"soft", {{0, {0, 0, 0}, 0}, {1, {1, 0.5, 0.25}, 0.1}}};
    const double levels = 1 + picture_change(soft, field.grid, charged);
    BOOST_TEST(levels < 32);
    const auto differs_softly = [&](auto&& change) {
      return differs([&](RenderOptions& o) {
        o.transfer = soft;
        o.shading = false;
        o.termination = 1;
        change(o);
      });
    };
    BOOST_TEST(differs_softly([](auto&) {}) <= levels);
    BOOST_TEST(differs_softly([](auto& o) { o.classification = Classification::preintegrated; }) <= levels);
    BOOST_TEST(differs_softly([](auto& o) { o.step_mode = StepMode::level; }) <= levels);
    // Where the filter is no better than 8 bits of weight, other pictures differ by more than rounding.
    if (!support::filters_exactly()) continue;
    BOOST_TEST(differs([](auto& o) { o.classification = Classification::preintegrated; }) <= 1);
    BOOST_TEST(differs([](auto& o) { o.step_mode = StepMode::level; }) <= 1);
    // The derivative of a cell jumps at its faces, where rounding may choose either cell: without light.
    BOOST_TEST(differs([](auto& o) { o.shading = false; }) <= 1);
    BOOST_TEST(differs([](auto& o) { o.lights = {{1, 0, -1}}; }) <= 1);
  }
}

namespace {

// The same less 1/128, so that offsets are negative where the field is almost 0, and fit 15 bits at any
// shift.
MixedVolume lowered(MixedVolume v) {
  const auto lower = [&](SampleBlock& block) {
    for (float& sample : block.f32) sample -= 0x1p-7f;
    for (std::int32_t& offset : block.offset) offset -= static_cast<std::int32_t>(0x1p-7 / v.step);
  };
  lower(v.base);
  for (auto& [kind, block] : v.tiles) lower(block);
  return v;
}

// With one more tile, which no brick has, whose offset no compact record could hold.
MixedVolume with_wide_records(MixedVolume v) {
  auto& [kind, block] = *v.tiles.rbegin();  // no other part of its triple goes on behind it
  const auto size = static_cast<std::size_t>(v.tile_size(kind));
  if (block.type == SampleType::u8) block.u8.resize(block.u8.size() + size);
  else block.u16.resize(block.u16.size() + size);
  block.offset.push_back(1 << 20);
  block.shift.push_back(0);
  return v;
}

void check_picture_of_decoded_values(const MixedVolume& integers) {
  MixedVolume floats = integers;
  floats.base = decoded(integers.base, integers.step);
  for (auto& [triple, block] : floats.tiles) block = decoded(block, integers.step);
  const ResidentVolume a(device(), integers), b(device(), floats);
  BOOST_TEST(a.bytes() < b.bytes());
  for (const RenderMode mode :
       {RenderMode::dvr, RenderMode::iso, RenderMode::mip, RenderMode::slice, RenderMode::integral})
    for (const int lanes : {1, 8}) {
      RenderOptions o = options_for(a.grid(), mode);
      o.surfaces = {{0.5}};
      o.sampler = SamplerKind::buffer;
      BOOST_TEST(same_bits(raycast_float(device(), a, o, {8, 8, lanes}).pixels,
                           raycast_float(device(), b, o, {8, 8, lanes}).pixels));
    }
}

}  // namespace

BOOST_AUTO_TEST_CASE(integer_samples_give_the_picture_of_their_decoded_values_to_the_bit) {
  for (const auto& types :
       {std::vector{SampleType::u16}, std::vector{SampleType::u8, SampleType::f32, SampleType::u16}})
    check_picture_of_decoded_values(types.size() > 1 ? support::in_types_by_tile(mixed_blob(), types)
                                                     : support::in_types(coarse_blob(), types));
  const MixedVolume u8 = support::in_types(coarse_blob(), {SampleType::u8});
  const MixedVolume low = lowered(u8), wide = with_wide_records(low);
  BOOST_TEST((record_kind(low) == RecordKind::compact));
  BOOST_TEST((record_kind(wide) == RecordKind::wide));
  for (const MixedVolume& v : {u8, low, wide}) check_picture_of_decoded_values(v);
}
