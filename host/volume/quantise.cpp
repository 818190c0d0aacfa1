// Lattices nest: offsets are multiples of 2^shift, so a value on a coarser one lies on every finer one.
#include "host/volume/quantise.hpp"

#include "host/volume/choose_lattice.hpp"

#include <algorithm>
#include <limits>

namespace vdvr {
namespace {

constexpr double kCodes = 0x1p24;  // |integer| stays below: exact in fp32

std::pair<float, float> range_of(std::span<const float> samples) {
  const auto [lo, hi] = std::minmax_element(samples.begin(), samples.end());
  return {*lo, *hi};
}

double code_of(float sample, double unit) { return std::nearbyint(static_cast<double>(sample) / unit); }

template <class T>
void put(std::span<const float> samples, double unit, double first, T* out) {
  for (std::size_t i = 0; i < samples.size(); ++i) out[i] = static_cast<T>(code_of(samples[i], unit) - first);
}

}  // namespace

std::optional<int> fitting_shift(float lo, float hi, const IntegerLattice& lattice, SampleType type,
                                 int most) {
  const double largest = std::max(std::abs(static_cast<double>(lo)), std::abs(static_cast<double>(hi)));
  // Rounding to the coarsest step may add half of it.
  if (!(largest + std::ldexp(lattice.step, most) < kCodes * lattice.step)) return std::nullopt;
  for (int shift = lattice.finest_shift; shift <= most; ++shift) {
    const double unit = std::ldexp(lattice.step, shift);
    if (code_of(hi, unit) - code_of(lo, unit) <= static_cast<double>(most_code(type))) return shift;
  }
  return std::nullopt;
}

double rounding_of(std::span<const float> tile, const IntegerLattice& lattice) {
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

void pack(std::span<const float> samples, const IntegerLattice& lattice, int shift, std::uint64_t tile,
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

void round_base(std::vector<float>& base, const IntegerLattice& lattice) {
  if (lattice.base == SampleType::f32) return;
  for (float& s : base) s = round_to(s, lattice.base_step());
}

SampleBlock pack_base(std::span<const float> base, const IntegerLattice& lattice) {
  SampleBlock b = empty_block(lattice.base, 1, base.size());
  pack(base, lattice, lattice.base_shift, 0, b);
  return b;
}

std::pair<float, float> base_limits(std::span<const float> base, const IntegerLattice& lattice) {
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
