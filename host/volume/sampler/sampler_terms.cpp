// Sampler error from the stored samples' slopes.
#include "host/volume/sampler/sampler_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "host/base/system/parallel.hpp"
#include "host/base/system/scratch_pass.hpp"
#include "host/volume/brick_layout.hpp"
#include "host/volume/sampler/resident_volume.hpp"

namespace vdvr {

namespace {

// The samples that a brick can interpolate, x fastest, and what neighbours differ by.
class BrickSteps {
 public:
  void read(const BrickSamples& stored) {
    for (std::size_t a = 0; a < 3; ++a) n_[a] = static_cast<std::size_t>(stored.end()[a]) + 1;
    samples_.clear();
    for (std::int64_t z = 0; z <= stored.end()[2]; ++z)
      for (std::int64_t y = 0; y <= stored.end()[1]; ++y)
        for (std::int64_t x = 0; x <= stored.end()[0]; ++x) samples_.push_back(stored(x, y, z));
  }

  [[nodiscard]] FieldSlopes::Brick steps() const {
    FieldSlopes::Brick out;
    for (const float s : samples_) out.magnitude = std::max(out.magnitude, static_cast<double>(std::abs(s)));
    std::array<float, 8> of_cells{};
    std::array<float, 3> largest{0, 0, 0};
    for (std::size_t z = 0; z + 1 < n_[2]; ++z)
      for (std::size_t y = 0; y + 1 < n_[1]; ++y)
        for (std::size_t x = 0; x + 1 < n_[0]; ++x) {
          const std::array<float, 3> cell = steps_of((z * n_[1] + y) * n_[0] + x);
          for (std::size_t a = 0; a < 3; ++a) largest[a] = std::max(largest[a], cell[a]);
          float& one = of_cells[FilterProbe::above_half(cell)];
          one = std::max({one, cell[0], cell[1], cell[2]});
        }
    std::copy(of_cells.begin(), of_cells.end(), out.of_cells.begin());
    std::copy(largest.begin(), largest.end(), out.per_sample.begin());
    return out;
  }

 private:
  // Of the cell whose first corner this is, along each axis.
  [[nodiscard]] std::array<float, 3> steps_of(std::size_t first) const {
    const float* s = samples_.data() + first;
    const std::size_t y = n_[0], z = n_[0] * n_[1];
    const auto step = [s](std::size_t from, std::size_t to) { return std::abs(s[to] - s[from]); };
    return {std::max({step(0, 1), step(y, y + 1), step(z, z + 1), step(y + z, y + z + 1)}),
            std::max({step(0, y), step(1, y + 1), step(z, y + z), step(z + 1, y + z + 1)}),
            std::max({step(0, z), step(1, z + 1), step(y, y + z), step(y + 1, y + z + 1)})};
  }

  std::array<std::size_t, 3> n_{};
  std::vector<float> samples_;
};

}  // namespace

FieldSlopes field_slopes(const MixedVolume& v) {
  const Index3 bricks = v.bricks();
  FieldSlopes out;
  out.bricks.resize(v.level.size());
  out.integers = sample_types(v) != 1 << VDVR_F32;
  std::mutex lock;
  ScratchPass pass;
  pass.add_all(v);
  parallel_for(bricks[2] * bricks[1], {}, "slopes", [&](std::int64_t row) {
    std::array<double, 3> per_cell{0, 0, 0};
    BrickSteps steps;
    const std::int64_t bz = row / bricks[1], by = row % bricks[1];
    for (std::int64_t bx = 0; bx < bricks[0]; ++bx) {
      const auto brick = static_cast<std::size_t>((bz * bricks[1] + by) * bricks[0] + bx);
      const BrickSamples stored(v, {bx, by, bz});
      pass.touched(sizeof(float) * static_cast<std::uint64_t>(v.tile_size(v.level[brick])));
      steps.read(stored);
      FieldSlopes::Brick& own = out.bricks[brick] = steps.steps();
      own.type = static_cast<SampleType>(stored.record().type);
      if (own.type != SampleType::f32)
        own.scale = (own.type == SampleType::u16 ? 65535 : 255) * static_cast<double>(stored.record().scale);
      for (std::size_t a = 0; a < 3; ++a)
        per_cell[a] = std::max(per_cell[a], own.per_sample[a] * std::ldexp(1.0, stored.per_cell()[a]));
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
  double magnitude = 0;
  float image = 0;
  bool has_image = atlas_length > 0;
  std::vector<float>& images = terms.image3d_by_brick;
  images.reserve(slopes.bricks.size());
  for (const FieldSlopes::Brick& b : slopes.bricks) {
    magnitude = std::max(magnitude, b.magnitude);
    const FilterProbe& filter = probe.of(b.type);
    has_image = has_image && filter.image3d;
    double weights = 0;
    for (std::size_t k = 0; k < b.of_cells.size(); ++k)
      weights = std::max(weights, filter.by_steps[k] * b.of_cells[k]);
    double own = coordinates + weights + 14 * u * b.magnitude +
                 (b.type == SampleType::f32 ? filter.constant_error * b.magnitude
                                            : (filter.constant_error + 4 * u) * b.scale);
    for (const double difference : b.per_sample)
      own += 2 * u * static_cast<double>(atlas_length) * difference;
    images.push_back(std::nextafter(static_cast<float>(own), std::numeric_limits<float>::infinity()));
    image = std::max(image, images.back());
  }
  const double buffer = 14 * u * magnitude + coordinates;
  terms.buffer = {buffer, "rounding: 14 u of the largest sample, 2 n u of the largest slope per cell"};
  if (has_image)
    terms.image3d = ErrorTerm{
        static_cast<double>(image),
        fmt::format("device probe, by brick: weights err by {:.3g}, products by {:.3g} of the sample",
                    std::max({probe.delta, probe.u16.delta, probe.u8.delta}),
                    probe.largest_constant_error())};
  else images.clear();
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
