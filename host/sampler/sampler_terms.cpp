// Sampler error from the stored samples' slopes.
#include "host/sampler/sampler_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "host/sampler/resident_volume.hpp"
#include "host/system/parallel.hpp"
#include "host/system/scratch_pass.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr {

FieldSlopes field_slopes(const MixedVolume& v) {
  const Index3 bricks = v.bricks();
  FieldSlopes out;
  out.bricks.resize(v.level.size());
  out.integers = sample_types(v) != 1 << VDVR_F32;
  std::mutex lock;
  ScratchPass pass;
  pass.add(v);
  parallel_for(bricks[2] * bricks[1], {}, "slopes", [&](std::int64_t row) {
    std::array<double, 3> per_cell{0, 0, 0};
    const std::int64_t bz = row / bricks[1], by = row % bricks[1];
    for (std::int64_t bx = 0; bx < bricks[0]; ++bx) {
      const BrickSamples stored(v, {bx, by, bz});
      pass.touched(sizeof(float) *
                   static_cast<std::uint64_t>(v.tile_size(
                       v.level[static_cast<std::size_t>((bz * bricks[1] + by) * bricks[0] + bx)])));
      const std::array<int, 3> finer = stored.per_cell();
      const Index3& end = stored.end();
      std::array<float, 3> largest{0, 0, 0};
      float magnitude = 0;
      for (std::int64_t z = 0; z <= end[2]; ++z)
        for (std::int64_t y = 0; y <= end[1]; ++y)
          for (std::int64_t x = 0; x <= end[0]; ++x) {
            const float s = stored(x, y, z);
            magnitude = std::max(magnitude, std::abs(s));
            if (x < end[0]) largest[0] = std::max(largest[0], std::abs(stored(x + 1, y, z) - s));
            if (y < end[1]) largest[1] = std::max(largest[1], std::abs(stored(x, y + 1, z) - s));
            if (z < end[2]) largest[2] = std::max(largest[2], std::abs(stored(x, y, z + 1) - s));
          }
      FieldSlopes::Brick& own = out.bricks[static_cast<std::size_t>((bz * bricks[1] + by) * bricks[0] + bx)];
      own.magnitude = static_cast<double>(magnitude);
      own.type = static_cast<SampleType>(stored.record().type);
      if (own.type != SampleType::f32)
        own.scale = (own.type == SampleType::u16 ? 65535 : 255) * static_cast<double>(stored.record().scale);
      for (std::size_t a = 0; a < 3; ++a) {
        own.per_sample[a] = static_cast<double>(largest[a]);
        per_cell[a] = std::max(per_cell[a], own.per_sample[a] * std::ldexp(1.0, finer[a]));
      }
    }
    const std::lock_guard guard(lock);
    for (std::size_t a = 0; a < 3; ++a) out.per_cell[a] = std::max(out.per_cell[a], per_cell[a]);
  });
  return out;
}

SamplerTerms sampler_terms(const FieldSlopes& slopes, const Grid& grid, const SamplerProbe& probe,
                           std::int64_t atlas_length, double node_error, int rate, double underflow) {
  constexpr double u = 0x1p-24;
  SamplerTerms terms;
  // Seven lerps of two rounded products and one rounded sum each, on three levels: 14 u of the largest sample
  // covers them. A cell coordinate rounds by at most 2 u of its size, and a wrong position costs its share of
  // the slope per cell, in whichever brick it ends. Where integer samples leave a step between bricks, it is
  // F whose slope counts beyond the face: at most V's and what the node error adds over a gold cell.
  const double seam = slopes.integers ? 6 * static_cast<double>(rate) * node_error : 0;
  double coordinates = underflow;
  for (std::size_t a = 0; a < 3; ++a)
    coordinates += 2 * u * static_cast<double>(grid.cells[a]) * (slopes.per_cell[a] + seam);
  double magnitude = 0, image = 0;
  bool has_image = atlas_length > 0;
  for (const FieldSlopes::Brick& b : slopes.bricks) {
    magnitude = std::max(magnitude, b.magnitude);
    const FilterProbe& filter = probe.of(b.type);
    has_image = has_image && filter.image3d;
    double own =
        14 * u * b.magnitude + (b.type == SampleType::f32 ? filter.constant_error * b.magnitude
                                                          : (filter.constant_error + 4 * u) * b.scale);
    for (const double difference : b.per_sample)
      own += (filter.delta + 2 * u * static_cast<double>(atlas_length)) * difference;
    image = std::max(image, own);
  }
  const double buffer = 14 * u * magnitude + coordinates;
  terms.buffer = {buffer, "rounding: 14 u of the largest sample, 2 n u of the largest slope per cell"};
  if (has_image)
    terms.image3d = ErrorTerm{
        image + coordinates,
        fmt::format("device probe, largest brick: weights err by {:.3g}, products by {:.3g} of the sample",
                    std::max({probe.delta, probe.u16.delta, probe.u8.delta}),
                    probe.largest_constant_error())};
  return terms;
}

FilterErrors filter_errors(const SamplerProbe& probe) {
  const auto beside_f32 = [&](const FilterProbe& p) {
    if (!probe.image3d || !p.image3d) return 0.0;
    return 3 * std::max(0.0, p.delta - probe.delta) + std::max(0.0, p.constant_error - probe.constant_error);
  };
  return {beside_f32(probe.u8), beside_f32(probe.u16)};
}

double sampler_underflow(const DeviceInfo& device) {
  // A sample as it is stored and decoded, and two products and a sum on each of three levels of
  // interpolation.
  return 16 * (device.subnormals ? 0x1p-149 : 0x1p-126);
}

std::int64_t longest_atlas(const DeviceInfo& device) {
  return static_cast<std::int64_t>(
      std::max({device.image3d_max[0], device.image3d_max[1], device.image3d_max[2]}));
}

std::int64_t atlas_length(const DeviceInfo& device, const MixedVolume& volume) {
  const AtlasLayout layout =
      pack_atlas(volume, image_limits(device, std::numeric_limits<std::uint64_t>::max()));
  return layout.fits ? static_cast<std::int64_t>(layout.longest()) : 0;
}

}  // namespace vdvr
