// What the two samplers can add to the error of a stored field (docs/error-bounds.md, section on samplers).
#pragma once

#include <array>
#include <vector>

#include "host/volume/choose_lattice.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/probe_sampler.hpp"

namespace vdvr {

/// Largest differences of neighbouring stored samples.
struct FieldSlopes {
  struct Brick {
    std::array<double, 3> per_sample{0, 0, 0};  ///< along x, y, z at its own spacing
    /// Of cells between its samples whose steps exceed half of their largest along the axes in the index
    /// (FilterProbe::above_half): the largest step.
    std::array<double, 8> of_cells{};
    double magnitude = 0;  ///< largest |sample|
    SampleType type = SampleType::f32;
    double scale = 0;  ///< integers: what the type's whole range decodes to
  };
  std::vector<Brick> bricks;
  std::array<double, 3> per_cell{0, 0, 0};  ///< over all bricks, per base cell
  bool integers = false;                    ///< base or some tiles are integers
};
/// Cost: one pass over all samples that a brick can interpolate, over all cores.
FieldSlopes field_slopes(const MixedVolume& volume);

/// buffer, the largest over the bricks: fp32 rounding of the coordinate and of seven interpolations. image3d,
/// by brick and the largest of them (charge_samplers() puts it beside the bricks' totals): the texture unit's
/// weights and products, as probed; absent where the device has no such sampler or `atlas_length` is 0.
/// `node_error`: what |V - F| may be at the gold nodes, and `rate`: theirs; both are used where bricks meet
/// with integer samples. `underflow`: sampler_underflow() in the units of the samples.
SamplerTerms sampler_terms(const FieldSlopes& slopes, const Grid& grid, const SamplerProbe& probe,
                           std::int64_t atlas_length, double node_error, int rate, double underflow = 0);

/// What the filters of integers may err by more than that of float32 (choose_lattice.hpp): three weights, by
/// the largest differences that there can be, and what is left of it where all samples are alike. An estimate
/// by which storage is chosen; what samplers are charged is sampler_terms().
FilterErrors filter_errors(const SamplerProbe& probe);

/// What a sampler may lose below the normal numbers of fp32, in world units, in which it works; on a device
/// that flushes those to 0, more.
double sampler_underflow(const DeviceInfo& device);

/// The longest side of an image atlas that a volume may be packed into.
std::int64_t longest_atlas(const DeviceInfo& device);
/// The longest side of the volume's own atlas on a device; 0 where it does not fit its images.
std::int64_t atlas_length(const DeviceInfo& device, const MixedVolume& volume);

}  // namespace vdvr
