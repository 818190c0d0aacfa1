// Checks of volumes, in the order in which later ones may rely on earlier ones.
#include "host/volume/validate_volume.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <span>
#include <cmath>
#include <limits>
#include <vector>

#include "host/files/io/text_encoding.hpp"

namespace vdvr {
namespace {

// Below and above, products of the step with a stored integer would leave the normal numbers of fp32.
constexpr double smallest_step = 0x1p-126, largest_step = 0x1p103;
constexpr int largest_rate = 64;
// Cell coordinates are fp32 in the sampler: beyond 2^24 neighbouring cells are no longer told apart.
constexpr std::int64_t most_cells = std::int64_t{1} << 24;
constexpr std::size_t longest_unit = 255;

}  // namespace

std::string name_of(const LevelTriple& l) { return fmt::format("{}{}{}", l[0], l[1], l[2]); }
std::string path_of(const TileKind& k) {
  return "/tiles/" + name_of(k.level) + (k.part == 0 ? "" : fmt::format("_{}", k.part));
}

std::optional<Problem> grid_problem(const MixedVolume& v) {
  const auto at_grid = [](std::string what) { return Problem{"/grid", std::move(what)}; };
  for (std::size_t a = 0; a < 3; ++a) {
    const char axis = "xyz"[a];
    if (v.grid.cells[a] < 1 || v.grid.cells[a] > most_cells)
      return at_grid(fmt::format("{} cells along {}, expected 1 to {}", v.grid.cells[a], axis, most_cells));
    if (!std::isfinite(v.grid.origin[a]))
      return at_grid(fmt::format("origin along {} is {}", axis, v.grid.origin[a]));
    if (!(v.grid.spacing[a] > 0) || !std::isfinite(v.grid.spacing[a]))
      return at_grid(
          fmt::format("spacing along {} is {}, expected a positive number", axis, v.grid.spacing[a]));
  }
  const Index3 s = v.grid.samples();
  // The sampler's stride from plane to plane is 32 bits wide; below that no product of three overflows 64
  // bits.
  if (s[0] * s[1] > std::numeric_limits<std::uint32_t>::max())
    return at_grid(
        fmt::format("a plane of {} x {} samples is beyond the sampler's 32-bit stride", s[0], s[1]));
  if (v.granularity < 1 || v.granularity > 8 || !std::has_single_bit(static_cast<unsigned>(v.granularity)))
    return at_grid(fmt::format("granularity {}, expected 1, 2, 4 or 8", v.granularity));
  if (v.rate < 1 || v.rate > largest_rate || !std::has_single_bit(static_cast<unsigned>(v.rate)))
    return at_grid(fmt::format("rate {}, expected a power of two up to {}", v.rate, largest_rate));
  for (std::size_t a = 0; a < 3; ++a) {
    const int c = v.coarsening[2 - a];
    if (c > 3 || v.granularity % (1 << c) != 0 || v.grid.cells[a] % (1 << c) != 0)
      return at_grid(fmt::format(
          "a base sample every 2^{} cells along {}, which must divide its {} cells and the granularity "
          "{}",
          c, "xyz"[a], v.grid.cells[a], v.granularity));
    if (c + std::countr_zero(static_cast<unsigned>(v.rate)) > largest_level)
      return at_grid(fmt::format(
          "rate {} with a base sample every 2^{} cells along {} has levels up to {}, expected at "
          "most {}",
          v.rate, c, "xyz"[a], c + std::countr_zero(static_cast<unsigned>(v.rate)), largest_level));
  }
  if (v.grid.unit.find('\0') != std::string::npos || v.grid.unit.size() > longest_unit)
    return at_grid(fmt::format("the unit has a zero byte or more than {} bytes", longest_unit));
  if (utf8_of(v.grid.unit) != v.grid.unit)
    return at_grid("the unit is no UTF-8, or begins with a byte order mark");
  return std::nullopt;
}

namespace {

std::string brick_text(const MixedVolume& v, std::size_t brick) {
  const Index3 b = v.bricks();
  const auto i = static_cast<std::int64_t>(brick);
  return fmt::format("brick [{}, {}, {}] (z, y, x)", i / (b[0] * b[1]), i / b[0] % b[1], i % b[0]);
}

}  // namespace

bool is_within_rate(const MixedVolume& v, const LevelTriple& l) {
  const LevelTriple finest = finest_level(v.rate, v.coarsening);
  return l[0] <= finest[0] && l[1] <= finest[1] && l[2] <= finest[2];
}

/// Levels within the rate, and every tile of every triple used by exactly one brick.
std::optional<Problem> index_problem(const MixedVolume& v, const std::map<TileKind, std::uint64_t>& counts) {
  std::map<LevelTriple, std::vector<bool>> used;
  for (const auto& [kind, count] : counts) {
    auto& flags = used[kind.level];
    flags.resize(flags.size() + count, false);
  }
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    const LevelTriple l = v.level[i];
    const std::uint32_t t = v.tile[i];
    if (!is_within_rate(v, l))
      return Problem{"/level",
                     fmt::format("{} has level {}, {}, {}; rate {} ends at {}", brick_text(v, i), l[0], l[1],
                                 l[2], v.rate, fmt::join(finest_level(v.rate, v.coarsening), ", "))};
    if (l == level_of_base) {
      if (t != 0)
        return Problem{"/tile",
                       fmt::format("{} reads the base but has tile {}, expected 0", brick_text(v, i), t)};
      continue;
    }
    const auto found = used.find(l);
    if (found == used.end())
      return Problem{"/level", fmt::format("{} has level {}, but there is no {}", brick_text(v, i),
                                           name_of(l), path_of(l))};
    if (t >= found->second.size())
      return Problem{"/tile", fmt::format("{} has tile {} of {}, which holds {}", brick_text(v, i), t,
                                          path_of(l), found->second.size())};
    if (found->second[t])
      return Problem{"/tile", fmt::format("{} has tile {} of {}, which another brick has", brick_text(v, i),
                                          t, path_of(l))};
    found->second[t] = true;
  }
  for (const auto& [triple, flags] : used)
    if (const auto free = std::find(flags.begin(), flags.end(), false); free != flags.end())
      return Problem{path_of(triple), fmt::format("no brick has tile {}", free - flags.begin())};
  return std::nullopt;
}

namespace {

std::optional<Problem> sample_problem(const std::string& where, std::span<const float> samples) {
  // An exponent of all ones; on bits, so that it vectorises and no compiler flag can assume it away.
  const auto is_bad = [](float s) { return (std::bit_cast<std::uint32_t>(s) & 0x7f800000u) == 0x7f800000u; };
  std::uint32_t bad = 0;
  for (const float s : samples) bad |= static_cast<std::uint32_t>(is_bad(s));
  if (bad == 0) return std::nullopt;
  const auto first = std::find_if(samples.begin(), samples.end(), is_bad);
  return Problem{where,
                 fmt::format("sample {} is {}, expected finite numbers", first - samples.begin(), *first)};
}

template <class T>
std::optional<Problem> code_problem(const std::string& where, const SampleBlock& b,
                                    const Samples<T>& stored) {
  const std::size_t tiles = b.offset.size(), per_tile = tiles == 0 ? 0 : stored.size() / tiles;
  for (std::size_t t = 0; t < tiles; ++t) {
    const int shift = b.shift[t];
    if (shift > largest_shift)
      return Problem{where,
                     fmt::format("the shift of tile {} is {}, expected at most {}", t, shift, largest_shift)};
    const std::int64_t offset = b.offset[t];
    if (offset % (std::int64_t{1} << shift) != 0)
      return Problem{where, fmt::format("offset {} of tile {} is no multiple of 2^{}", offset, t, shift)};
    const auto first = stored.begin() + static_cast<std::ptrdiff_t>(t * per_tile);
    const std::int64_t most = *std::max_element(first, first + static_cast<std::ptrdiff_t>(per_tile));
    if (offset <= -code_limit || offset + (most << shift) >= code_limit)
      return Problem{where,
                     fmt::format("tile {} holds integers from {} to {}, expected below 2^24 in magnitude", t,
                                 offset, offset + (most << shift))};
  }
  return std::nullopt;
}

}  // namespace

/// What is wrong with the samples of a block whose vectors have the right sizes.
std::optional<Problem> block_problem(const std::string& where, const SampleBlock& b) {
  if (b.type == SampleType::f32) return sample_problem(where, b.f32);
  return b.type == SampleType::u16 ? code_problem(where, b, b.u16) : code_problem(where, b, b.u8);
}

bool has_integers(const MixedVolume& v) {
  bool any = false;
  for_each_block(v, [&](const SampleBlock& block) { any = any || block.type != SampleType::f32; });
  return any;
}

std::optional<Problem> step_problem(const MixedVolume& v) {
  int exponent = 0;
  const bool fits = v.step >= smallest_step && v.step <= largest_step && std::frexp(v.step, &exponent) == 0.5;
  if (fits) return std::nullopt;
  return Problem{"attribute 'step' of /",
                 fmt::format("is {}, expected a power of two from 2^-126 to 2^103", v.step)};
}

namespace {

std::optional<Problem> size_problem(const std::string& where, std::uint64_t have, std::uint64_t expected) {
  if (have == expected) return std::nullopt;
  return Problem{where, fmt::format("holds {} elements, the grid needs {}", have, expected)};
}

}  // namespace

/// The parts of a triple follow one another, and no two have the same type.
std::optional<Problem> parts_problem(const std::map<TileKind, SampleType>& types) {
  for (const auto& [kind, type] : types)
    for (std::uint8_t part = 0; part < kind.part; ++part) {
      const auto other = types.find({kind.level, part});
      if (other == types.end())
        return Problem{path_of(kind),
                       fmt::format("is there without {}", path_of(TileKind(kind.level, part)))};
      if (other->second == type)
        return Problem{path_of(kind),
                       fmt::format("has the type of {}, expected another", path_of(other->first))};
    }
  return std::nullopt;
}

bool has_parts(const MixedVolume& v) {
  return std::any_of(v.tiles.begin(), v.tiles.end(),
                     [](const auto& tiles) { return tiles.first.part > 0 && tiles.second.size() > 0; });
}

/// Everything the reader would refuse, so that the writer never writes it.
std::optional<Problem> validate_volume(const MixedVolume& v) {
  if (auto p = grid_problem(v)) return p;
  const auto bricks = static_cast<std::uint64_t>(v.brick_count());
  const Index3 base = v.base_samples();
  if (auto p = size_problem("/base", v.base.size(), static_cast<std::uint64_t>(base[0] * base[1] * base[2])))
    return p;
  if (auto p = size_problem("/level", v.level.size(), bricks)) return p;
  if (auto p = size_problem("/tile", v.tile.size(), bricks)) return p;
  std::map<TileKind, std::uint64_t> counts;
  std::map<TileKind, SampleType> types;
  const auto tables_problem = [](const std::string& where, const SampleBlock& b,
                                 std::uint64_t tiles) -> std::optional<Problem> {
    if (b.type == SampleType::f32) tiles = 0;
    if (b.offset.size() == tiles && b.shift.size() == tiles) return std::nullopt;
    return Problem{where, fmt::format("has {} offsets and {} shifts for {} tiles of integers",
                                      b.offset.size(), b.shift.size(), tiles)};
  };
  if (auto p = tables_problem("/base", v.base, 1)) return p;
  if (has_integers(v))
    if (auto p = step_problem(v)) return p;
  for (const auto& [triple, samples] : v.tiles) {
    if (triple.level == level_of_base)
      return Problem{path_of(triple), "level 0,0,0 reads the base and has no tiles"};
    if (*std::max_element(triple.level.begin(), triple.level.end()) > largest_level)
      return Problem{path_of(triple), fmt::format("a level above {}", largest_level)};
    if (triple.part >= most_parts) return Problem{path_of(triple), "more parts than sample types"};
    const auto size = static_cast<std::uint64_t>(v.tile_size(triple));
    if (samples.size() % size != 0)
      return Problem{path_of(triple), fmt::format("{} samples are no whole number of tiles", samples.size())};
    if (auto p = tables_problem(path_of(triple), samples, samples.size() / size)) return p;
    if (samples.size() == 0) continue;
    counts[triple] = samples.size() / size;
    types[triple] = samples.type;
  }
  if (auto p = parts_problem(types)) return p;
  if (auto p = index_problem(v, counts)) return p;
  if (auto p = block_problem("/base", v.base)) return p;
  for (const auto& [triple, samples] : v.tiles)
    if (auto p = block_problem(path_of(triple), samples)) return p;
  return std::nullopt;
}

}  // namespace vdvr
