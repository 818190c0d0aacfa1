// Integer samples: which lattice a file takes, rounding to it, and packing tiles into 8 or 16 bits
// (docs/file-format.md, storage).
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

/// One lattice for the whole file: values are step * integer, |integer| < 2^24. Base and tiles round to
/// multiples of step * 2^shift, their own step. No tile's own step is coarser than the base's, so that base
/// samples, which are final before any tile exists, are exact in every tile.
struct IntegerLattice {
  double step = 0;  ///< a power of two; 0: no integers, everything is float32
  SampleType base = SampleType::f32;
  SampleType least = SampleType::f32;  ///< the smallest type that a tile may take
  int base_shift = 0;
  /// No tile's own step is finer than step * 2^finest_shift, a quarter of the base's. What lies below is lost
  /// beside the base's rounding and does not compress. |sample| < 2^24 steps, so that from 10 on, as u8 has
  /// it, offsets fit a compact brick record (mixed_sampler.h).
  int finest_shift = 0;
  [[nodiscard]] double base_step() const { return std::ldexp(step, base_shift); }
};

/// The lattice for these base samples. u8, u16: the base's step is the finest with which 8 / 16 bits hold the
/// range of the base and an eighth more. automatic: u8 if half of that step is at most `most_rounding`; else
/// u16 with the coarsest step of which that holds; else float32.
/// `density`: log2 of what a sample of 1 stands for in the file, whose step is a normal number of fp32.
IntegerLattice choose_lattice(std::span<const float> base, StorageChoice choice, double most_rounding,
                              int density = 0);

/// What `automatic` takes for `most_rounding`: a brick that coarse rounding raises by a level of one axis
/// costs less than one raised by a level of all.
inline double most_rounding(double epsilon_abs, bool anisotropic) {
  return epsilon_abs / (anisotropic ? 5 : 8);
}

/// Nearest multiple of `unit`; unit 0: the value itself. Never -0, which integers do not have.
inline float round_to(float value, double unit) {
  if (unit == 0) return value;
  return static_cast<float>(unit * std::nearbyint(static_cast<double>(value) / unit)) + 0.0f;
}

/// The smallest shift, from the lattice's finest, with which samples between lo and hi fit `type` after
/// rounding; none beyond `most`, or where |value| reaches 2^24 steps.
std::optional<int> fitting_shift(float lo, float hi, const IntegerLattice& lattice, SampleType type,
                                 int most);

/// What rounding to its own step may move a sample of such a tile; 0 where it is stored in float32.
double rounding_of(std::span<const float> tile, const IntegerLattice& lattice);

/// A block of `tiles` tiles of `tile_size` samples each, to be filled by pack(); in memory without `scratch`.
SampleBlock empty_block(SampleType type, std::uint64_t tiles, std::uint64_t tile_size,
                        const std::shared_ptr<Scratch>& scratch = nullptr);
/// Stores one tile; rounds its samples to its own step. Integers: they fit, by fitting_shift.
void pack(std::span<const float> samples, const IntegerLattice& lattice, int shift, std::uint64_t tile,
          SampleBlock& block);

/// Rounds base samples to the base's step.
void round_base(std::vector<float>& base, const IntegerLattice& lattice);
/// The base as it is stored: its samples lie on the lattice already.
SampleBlock pack_base(std::span<const float> base, const IntegerLattice& lattice);
/// Values between which samples of this base may be moved with all of it still fitting its type.
std::pair<float, float> base_limits(std::span<const float> base, const IntegerLattice& lattice);

}  // namespace vdvr
