// Lattices nest: offsets are multiples of 2^shift, so a value on a coarser one lies on every finer one.
#include "host/volume/quantise.hpp"

#include <algorithm>
#include <limits>

namespace vdvr {
namespace {

constexpr double kCodes = 0x1p24;  // |integer| stays below: exact in fp32

std::int64_t most_code(SampleType type) { return type == SampleType::u8 ? 255 : 65535; }

std::pair<float, float> range_of(std::span<const float> samples) {
  const auto [lo, hi] = std::minmax_element(samples.begin(), samples.end());
  return {*lo, *hi};
}

// The smallest n with 2^n >= x > 0.
int ceil_log2(double x) {
  int n = 0;
  const double fraction = std::frexp(x, &n);  // x = fraction 2^n, 1/2 <= fraction < 1
  return fraction == 0.5 ? n - 1 : n;
}
int floor_log2(double x) { return std::ilogb(x); }

double code_of(float sample, double unit) { return std::nearbyint(static_cast<double>(sample) / unit); }

template <class T>
void put(std::span<const float> samples, double unit, double first, T* out) {
  for (std::size_t i = 0; i < samples.size(); ++i) out[i] = static_cast<T>(code_of(samples[i], unit) - first);
}

}  // namespace

Lattice choose_lattice(std::span<const float> base, StorageChoice choice, double rounding, int density) {
  Lattice lattice;
  if (choice == StorageChoice::f32 || base.empty()) return lattice;
  const auto [lo, hi] = range_of(base);
  double magnitude =
      std::max({std::abs(static_cast<double>(lo)), std::abs(static_cast<double>(hi)), rounding});
  if (!(magnitude > 0)) magnitude = 1;
  // Two bits are left above the base's largest sample, for tiles that rise above it. Beyond these ends a
  // product would leave the normal numbers of fp32.
  const int finest = std::clamp(ceil_log2(magnitude) - 22, -126 - density, 103 - density);
  // Room for tiles whose samples lie between the base's and exceed them.
  const double range = 1.125 * (static_cast<double>(hi) - static_cast<double>(lo));
  const auto finest_for = [&](SampleType type) {
    return range > 0 ? std::max(finest, ceil_log2(range / static_cast<double>(most_code(type)))) : finest;
  };
  const int u8 = finest_for(SampleType::u8), u16 = finest_for(SampleType::u16);
  const int coarsest = rounding > 0 ? floor_log2(2 * rounding) : finest - 1;
  lattice.step = std::ldexp(1.0, finest);
  lattice.least = choice == StorageChoice::u16 ? SampleType::u16 : SampleType::u8;
  if (choice == StorageChoice::u8 || (choice == StorageChoice::automatic && u8 <= coarsest)) {
    lattice.base = SampleType::u8;
    lattice.base_shift = u8 - finest;
  } else if (choice == StorageChoice::u16 || u16 <= coarsest) {
    lattice.base = SampleType::u16;
    // The base has bits to spare; a coarse step of its own lets more tiles do with 8.
    lattice.base_shift = (choice == StorageChoice::u16 ? u16 : coarsest) - finest;
  } else {
    return {};
  }
  lattice.finest_shift = std::max(lattice.base_shift - 2, 0);
  return lattice;
}

std::optional<int> fitting_shift(float lo, float hi, const Lattice& lattice, SampleType type, int most) {
  const double largest = std::max(std::abs(static_cast<double>(lo)), std::abs(static_cast<double>(hi)));
  // Rounding to the coarsest step may add half of it.
  if (!(largest + std::ldexp(lattice.step, most) < kCodes * lattice.step)) return std::nullopt;
  for (int shift = lattice.finest_shift; shift <= most; ++shift) {
    const double unit = std::ldexp(lattice.step, shift);
    if (code_of(hi, unit) - code_of(lo, unit) <= static_cast<double>(most_code(type))) return shift;
  }
  return std::nullopt;
}

double rounding_of(std::span<const float> tile, const Lattice& lattice) {
  if (lattice.step == 0 || tile.empty()) return 0;
  const auto [lo, hi] = range_of(tile);
  for (const SampleType type : {SampleType::u8, SampleType::u16}) {
    if (type > lattice.least) continue;
    if (const auto shift = fitting_shift(lo, hi, lattice, type, lattice.base_shift))
      return std::ldexp(lattice.step, *shift - 1);
  }
  return 0;
}

SampleBlock empty_block(SampleType type, std::uint64_t tiles, std::uint64_t tile_size,
                        const std::shared_ptr<Scratch>& scratch) {
  SampleBlock b;
  b.type = type;
  const auto make = [&](auto& samples) { samples = {tiles * tile_size, scratch, "the closed volume"}; };
  if (type == SampleType::f32) {
    make(b.f32);
    return b;
  }
  if (type == SampleType::u16) make(b.u16);
  else make(b.u8);
  b.offset.resize(tiles);
  b.shift.resize(tiles);
  return b;
}

void pack(std::span<const float> samples, const Lattice& lattice, int shift, std::uint64_t tile,
          SampleBlock& block) {
  const std::size_t first_sample = tile * samples.size();
  if (block.type == SampleType::f32) {
    std::copy(samples.begin(), samples.end(), block.f32.begin() + static_cast<std::ptrdiff_t>(first_sample));
    return;
  }
  const double unit = std::ldexp(lattice.step, shift);
  const double first = code_of(range_of(samples).first, unit);
  block.shift[tile] = static_cast<std::uint8_t>(shift);
  block.offset[tile] = static_cast<std::int32_t>(std::ldexp(first, shift));
  if (block.type == SampleType::u16) put(samples, unit, first, block.u16.data() + first_sample);
  else put(samples, unit, first, block.u8.data() + first_sample);
}

void round_base(std::vector<float>& base, const Lattice& lattice) {
  if (lattice.base == SampleType::f32) return;
  for (float& s : base) s = round_to(s, lattice.base_step());
}

SampleBlock pack_base(std::span<const float> base, const Lattice& lattice) {
  SampleBlock b = empty_block(lattice.base, 1, base.size());
  pack(base, lattice, lattice.base_shift, 0, b);
  return b;
}

std::pair<float, float> base_limits(std::span<const float> base, const Lattice& lattice) {
  if (lattice.base == SampleType::f32)
    return {-std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
  const auto [lo, hi] = range_of(base);
  const double unit = lattice.base_step();
  const double spare =
      unit *
      std::floor((static_cast<double>(most_code(lattice.base)) - code_of(hi, unit) + code_of(lo, unit)) / 2);
  return {static_cast<float>(static_cast<double>(lo) - spare),
          static_cast<float>(static_cast<double>(hi) + spare)};
}

}  // namespace vdvr
