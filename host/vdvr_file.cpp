// The .vdvr file (docs/file-format.md): written whole or not at all, read only after everything in it has
// been checked. Datasets are [z][y][x] and triples "ZYX", as MixedVolume holds them; grid attributes are
// turned from x,y,z to z,y,x. Called by build, verify, render, probe, export, info.
#include "vdvr/vdvr_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <optional>
#include <span>

#include "host/io/atomic_file.hpp"
#include "host/io/hdf5_file.hpp"
#include "host/io/rehearsal.hpp"
#include "vdvr/error.hpp"
#include "vdvr/hash.hpp"

namespace vdvr {
namespace {

namespace h5 = io::hdf5_file;

static_assert(std::endian::native == std::endian::little,
              "content_sha256 hashes memory, which must be little-endian");

// Version 2 is version 1 with integer samples; files without any are still written as 1.
constexpr int newest_version = 2;
// Below and above, products of the step with a stored integer would leave the normal numbers of fp32.
constexpr double smallest_step = 0x1p-126, largest_step = 0x1p103;
constexpr int largest_shift = 24;
constexpr std::int64_t code_limit = std::int64_t{1} << 24;  // integers below are exact in fp32
constexpr int largest_rate = 64;
// Cell coordinates are fp32 in the sampler: beyond 2^24 neighbouring cells are no longer told apart.
constexpr std::int64_t most_cells = std::int64_t{1} << 24;
constexpr std::size_t longest_unit = 255;
constexpr std::uint64_t longest_certificate = 64u << 20;
constexpr LevelTriple in_base{0, 0, 0};

/// What is wrong with a volume, and where: the reader makes a FileError of it, the writer an InputError.
struct Problem {
  std::string where, what;
};

std::string name_of(const LevelTriple& l) { return fmt::format("{}{}{}", l[0], l[1], l[2]); }
std::string path_of(const LevelTriple& l) { return "/tiles/" + name_of(l); }

template <class T>
std::array<T, 3> zyx(const std::array<T, 3>& xyz) {
  return {xyz[2], xyz[1], xyz[0]};
}

h5::Shape shape_of(std::initializer_list<std::int64_t> extents) {
  h5::Shape shape;
  for (const std::int64_t n : extents) shape.push_back(static_cast<std::uint64_t>(n));
  return shape;
}

h5::Shape base_shape(const MixedVolume& v) {
  const Index3 s = v.grid.samples();
  return shape_of({s[2], s[1], s[0]});
}

std::string text_of(const h5::Shape& shape) { return fmt::format("[{}]", fmt::join(shape, ", ")); }

// --- what a volume must satisfy
// ---------------------------------------------------------------------------------------

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
  if (v.grid.unit.find('\0') != std::string::npos || v.grid.unit.size() > longest_unit)
    return at_grid(fmt::format("the unit has a zero byte or more than {} bytes", longest_unit));
  return std::nullopt;
}

std::string brick_text(const MixedVolume& v, std::size_t brick) {
  const Index3 b = v.bricks();
  const auto i = static_cast<std::int64_t>(brick);
  return fmt::format("brick [{}, {}, {}] (z, y, x)", i / (b[0] * b[1]), i / b[0] % b[1], i % b[0]);
}

/// Levels within the rate, and every tile of every triple used by exactly one brick.
std::optional<Problem> index_problem(const MixedVolume& v,
                                     const std::map<LevelTriple, std::uint64_t>& counts) {
  const int finest = std::countr_zero(static_cast<unsigned>(v.rate));
  std::map<LevelTriple, std::vector<bool>> used;
  for (const auto& [triple, count] : counts) used[triple].assign(count, false);
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    const LevelTriple l = v.level[i];
    const std::uint32_t t = v.tile[i];
    if (*std::max_element(l.begin(), l.end()) > finest)
      return Problem{"/level", fmt::format("{} has level {}, {}, {}; rate {} ends at {}", brick_text(v, i),
                                           l[0], l[1], l[2], v.rate, finest)};
    if (l == in_base) {
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

std::optional<Problem> sample_problem(const std::string& where, const std::vector<float>& samples) {
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
                                    const std::vector<T>& stored) {
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

/// What is wrong with the samples of a block whose vectors have the right sizes.
std::optional<Problem> block_problem(const std::string& where, const SampleBlock& b) {
  if (b.type == SampleType::f32) return sample_problem(where, b.f32);
  return b.type == SampleType::u16 ? code_problem(where, b, b.u16) : code_problem(where, b, b.u8);
}

bool has_integers(const MixedVolume& v) {
  bool any = v.base.type != SampleType::f32;
  for (const auto& [triple, block] : v.tiles) any = any || block.type != SampleType::f32;
  return any;
}

std::optional<Problem> step_problem(const MixedVolume& v) {
  int exponent = 0;
  const bool fits = v.step >= smallest_step && v.step <= largest_step && std::frexp(v.step, &exponent) == 0.5;
  if (fits) return std::nullopt;
  return Problem{"attribute 'step' of /",
                 fmt::format("is {}, expected a power of two from 2^-126 to 2^103", v.step)};
}

std::optional<Problem> size_problem(const std::string& where, std::uint64_t have, std::uint64_t expected) {
  if (have == expected) return std::nullopt;
  return Problem{where, fmt::format("holds {} elements, the grid needs {}", have, expected)};
}

/// Everything the reader would refuse, so that the writer never writes it.
std::optional<Problem> volume_problem(const MixedVolume& v) {
  if (auto p = grid_problem(v)) return p;
  const auto bricks = static_cast<std::uint64_t>(v.brick_count());
  if (auto p = size_problem("/base", v.base.size(), static_cast<std::uint64_t>(v.grid.sample_count())))
    return p;
  if (auto p = size_problem("/level", v.level.size(), bricks)) return p;
  if (auto p = size_problem("/tile", v.tile.size(), bricks)) return p;
  std::map<LevelTriple, std::uint64_t> counts;
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
    if (triple == in_base) return Problem{path_of(triple), "level 0,0,0 reads the base and has no tiles"};
    if (*std::max_element(triple.begin(), triple.end()) > 6)
      return Problem{path_of(triple), "a level above 6"};
    const auto size = static_cast<std::uint64_t>(v.tile_size(triple));
    if (samples.size() % size != 0)
      return Problem{path_of(triple), fmt::format("{} samples are no whole number of tiles", samples.size())};
    if (auto p = tables_problem(path_of(triple), samples, samples.size() / size)) return p;
    if (samples.size() != 0) counts[triple] = samples.size() / size;
  }
  if (auto p = index_problem(v, counts)) return p;
  if (auto p = block_problem("/base", v.base)) return p;
  for (const auto& [triple, samples] : v.tiles)
    if (auto p = block_problem(path_of(triple), samples)) return p;
  return std::nullopt;
}

// --- writing
// ----------------------------------------------------------------------------------------------------------

void write_grid(h5::Writer& file, const MixedVolume& v) {
  file.group("/grid");
  file.attribute("/grid", "cells", zyx(v.grid.cells));
  file.attribute("/grid", "origin", zyx(v.grid.origin));
  file.attribute("/grid", "spacing", zyx(v.grid.spacing));
  file.attribute("/grid", "unit", v.grid.unit);
  file.attribute("/grid", "granularity", std::int64_t{v.granularity});
  file.attribute("/grid", "rate", std::int64_t{v.rate});
}

void write_index(h5::Writer& file, const MixedVolume& v) {
  const Index3 b = v.bricks();
  static_assert(sizeof(LevelTriple) == 3);
  file.dataset("/level", shape_of({b[2], b[1], b[0], 3}),
               std::span<const std::uint8_t>(v.level.data()->data(), 3 * v.level.size()));
  file.dataset("/tile", shape_of({b[2], b[1], b[0]}), std::span<const std::uint32_t>(v.tile));
}

/// Samples, and offset and shift of each tile where they are integers.
void write_block(h5::Writer& file, const std::string& path, const h5::Shape& shape, const SampleBlock& b) {
  if (b.type == SampleType::f32) file.dataset(path, shape, std::span<const float>(b.f32));
  else if (b.type == SampleType::u16) file.dataset(path, shape, std::span<const std::uint16_t>(b.u16));
  else file.dataset(path, shape, std::span<const std::uint8_t>(b.u8));
  if (b.type == SampleType::f32) return;
  if (path == "/base") {
    file.attribute(path, "offset", std::int64_t{b.offset.front()});
    file.attribute(path, "shift", std::int64_t{b.shift.front()});
    return;
  }
  file.dataset(path + "_offset", {b.offset.size()}, std::span<const std::int32_t>(b.offset));
  file.dataset(path + "_shift", {b.shift.size()}, std::span<const std::uint8_t>(b.shift));
}

// --- reading
// ----------------------------------------------------------------------------------------------------------

int read_version(const h5::Reader& file) {
  if (!file.has_attribute("/", "format") || file.text_attribute("/", "format") != "vdvr")
    file.refuse("attribute 'format' of /", "does not say vdvr: this is another kind of HDF5 file");
  const std::int64_t version = file.integer("/", "format_version");
  if (version < 1) file.refuse("attribute 'format_version' of /", fmt::format("is {}", version));
  if (version > newest_version)
    file.refuse("attribute 'format_version' of /",
                fmt::format("is {}; this program reads up to {}: use a newer one", version, newest_version));
  return static_cast<int>(version);
}

int read_small(const h5::Reader& file, const char* name) {
  // Anything outside int is outside every range checked later as well.
  return static_cast<int>(
      std::clamp<std::int64_t>(file.integer("/grid", name), -1, std::numeric_limits<int>::max()));
}

void read_grid(const h5::Reader& file, MixedVolume& v) {
  file.require_group("/grid");
  const auto cells = file.integers("/grid", "cells", 3);
  const auto origin = file.reals("/grid", "origin", 3), spacing = file.reals("/grid", "spacing", 3);
  for (std::size_t a = 0; a < 3; ++a) {
    v.grid.cells[a] = cells[2 - a];
    v.grid.origin[a] = origin[2 - a];
    v.grid.spacing[a] = spacing[2 - a];
  }
  v.grid.unit = file.text_attribute("/grid", "unit");
  v.granularity = read_small(file, "granularity");
  v.rate = read_small(file, "rate");
  if (const auto p = grid_problem(v)) file.refuse(p->where, p->what);
}

/// A dataset of the right type and shape; a zero in `shape` stands for any extent.
h5::Dataset expect(const h5::Reader& file, const std::string& path, const std::vector<h5::Element>& elements,
                   const h5::Shape& shape) {
  h5::Dataset d = file.dataset(path);
  if (std::find(elements.begin(), elements.end(), d.element) == elements.end())
    file.refuse(path, fmt::format("elements are of the wrong type, expected {}",
                                  elements.size() > 1                    ? "float32, uint16 or uint8"
                                  : elements.front() == h5::Element::u8  ? "uint8"
                                  : elements.front() == h5::Element::i32 ? "int32"
                                                                         : "uint32"));
  bool fits = d.shape.size() == shape.size();
  for (std::size_t a = 0; fits && a < shape.size(); ++a) fits = shape[a] == 0 || d.shape[a] == shape[a];
  if (!fits) {
    std::string wanted = text_of(shape);
    if (shape.front() == 0) wanted.replace(1, 1, "count");
    file.refuse(path, fmt::format("has shape {}, the grid needs {}", text_of(d.shape), wanted));
  }
  return d;
}

LevelTriple triple_of(const h5::Reader& file, const std::string& name) {
  const bool digits =
      name.size() == 3 && std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '6'; });
  if (!digits || name == "000")
    file.refuse("/tiles/" + name, "is not named by a level triple, three digits z, y, x such as 111 or 021");
  LevelTriple l{};
  for (std::size_t a = 0; a < 3; ++a) l[a] = static_cast<std::uint8_t>(name[a] - '0');
  return l;
}

const std::vector<h5::Element> kSampleElements{h5::Element::f32, h5::Element::u16, h5::Element::u8};

/// All datasets of one file, checked but not yet read.
struct Contents {
  h5::Dataset base, level, tile;
  std::map<LevelTriple, h5::Dataset> tiles, offsets, shifts;
  std::map<LevelTriple, std::uint64_t> counts;
};

/// Offsets and shifts go with integer tiles, and with no others.
void open_tables(const h5::Reader& file, Contents& c) {
  for (const auto& [l, d] : c.tiles) {
    const std::string offset = path_of(l) + "_offset", shift = path_of(l) + "_shift";
    if (d.element == h5::Element::f32) continue;
    for (const std::string& path : {offset, shift})
      if (!file.has(path))
        file.refuse(path, fmt::format("is missing beside the integer tiles of {}", path_of(l)));
    c.offsets[l] = expect(file, offset, {h5::Element::i32}, {c.counts[l]});
    c.shifts[l] = expect(file, shift, {h5::Element::u8}, {c.counts[l]});
  }
}

Contents open_contents(const h5::Reader& file, const MixedVolume& v) {
  const Index3 b = v.bricks();
  Contents c;
  c.base = expect(file, "/base", kSampleElements, base_shape(v));
  c.level = expect(file, "/level", {h5::Element::u8}, shape_of({b[2], b[1], b[0], 3}));
  c.tile = expect(file, "/tile", {h5::Element::u32}, shape_of({b[2], b[1], b[0]}));
  if (!file.has("/tiles")) return c;
  file.require_group("/tiles");
  const int finest = std::countr_zero(static_cast<unsigned>(v.rate));
  std::vector<std::string> tables;
  for (const std::string& name : file.members("/tiles")) {
    if (name.ends_with("_offset") || name.ends_with("_shift")) {
      tables.push_back(name.substr(0, name.find('_')));
      continue;
    }
    const LevelTriple l = triple_of(file, name);
    if (*std::max_element(l.begin(), l.end()) > finest)
      file.refuse(path_of(l), fmt::format("is beyond rate {}, which ends at level {}", v.rate, finest));
    const auto side = v.tile_shape(l);
    c.tiles[l] = expect(file, path_of(l), kSampleElements, shape_of({0, side[0], side[1], side[2]}));
    c.counts[l] = c.tiles[l].shape.front();
    if (c.counts[l] > c.tile.count)
      file.refuse(path_of(l), fmt::format("{} tiles for {} bricks", c.counts[l], c.tile.count));
  }
  open_tables(file, c);
  for (const std::string& name : tables) {
    const auto found = c.offsets.find(triple_of(file, name));
    if (found == c.offsets.end())
      file.refuse("/tiles/" + name + "_offset or _shift", "belongs to no integer tiles of that name");
  }
  return c;
}

/// Memory by declared sizes, before any of it is taken.
void check_memory(const h5::Reader& file, const std::string& path, const Contents& c,
                  std::uint64_t max_memory_bytes) {
  std::uint64_t stored = c.base.stored_bytes + c.level.stored_bytes + c.tile.stored_bytes;
  std::uint64_t needed = c.base.bytes + c.level.bytes + c.tile.bytes + c.tile.count / 8;
  for (const auto* datasets : {&c.tiles, &c.offsets, &c.shifts})
    for (const auto& [triple, d] : *datasets) {
      stored += d.stored_bytes;
      needed += d.bytes;
    }
  if (stored > file.file_bytes())
    file.refuse(
        "/", fmt::format("datasets claim {} bytes in a file of {}: they overlap", stored, file.file_bytes()));
  if (max_memory_bytes != 0 && needed > max_memory_bytes)
    throw ResourceError(
        fmt::format("{}: reading needs {} bytes of memory, {} are allowed: raise --max-memory", path, needed,
                    max_memory_bytes));
}

void read_samples(const h5::Reader& file, const h5::Dataset& d, SampleBlock& b) {
  const auto into = [&](auto& samples) {
    samples.resize(d.count);
    file.read(d, samples.data());
  };
  b.type = d.element == h5::Element::f32   ? SampleType::f32
           : d.element == h5::Element::u16 ? SampleType::u16
                                           : SampleType::u8;
  if (b.type == SampleType::f32) into(b.f32);
  else if (b.type == SampleType::u16) into(b.u16);
  else into(b.u8);
}

/// The base's offset and shift, as attributes of any integer type.
void read_base_table(const h5::Reader& file, SampleBlock& b) {
  const auto value = [&](const char* name, std::int64_t most) {
    const std::int64_t n = file.integer("/base", name);
    if (n < (name[0] == 'o' ? -most : 0) || n > most)
      file.refuse(fmt::format("attribute '{}' of /base", name),
                  fmt::format("is {}, expected at most {}", n, most));
    return n;
  };
  b.offset = {static_cast<std::int32_t>(value("offset", code_limit))};
  b.shift = {static_cast<std::uint8_t>(value("shift", largest_shift))};
}

void read_volume_data(const h5::Reader& file, const Contents& c, MixedVolume& v) {
  v.level.resize(c.tile.count);
  file.read(c.level, v.level.data());
  v.tile.resize(c.tile.count);
  file.read(c.tile, v.tile.data());
  if (const auto p = index_problem(v, c.counts)) file.refuse(p->where, p->what);
  read_samples(file, c.base, v.base);
  if (v.base.type != SampleType::f32) read_base_table(file, v.base);
  for (const auto& [triple, d] : c.tiles) {
    SampleBlock& b = v.tiles[triple];
    read_samples(file, d, b);
    if (b.type == SampleType::f32) continue;
    b.offset.resize(c.counts.at(triple));
    b.shift.resize(c.counts.at(triple));
    file.read(c.offsets.at(triple), b.offset.data());
    file.read(c.shifts.at(triple), b.shift.data());
  }
  if (const auto p = block_problem("/base", v.base)) file.refuse(p->where, p->what);
  for (const auto& [triple, block] : v.tiles)
    if (const auto p = block_problem(path_of(triple), block)) file.refuse(p->where, p->what);
}

/// The step, which goes with integer samples and with no others.
void read_step(const h5::Reader& file, const Contents& c, MixedVolume& v) {
  bool integers = c.base.element != h5::Element::f32;
  for (const auto& [triple, d] : c.tiles) integers = integers || d.element != h5::Element::f32;
  const char* where = "attribute 'step' of /";
  if (integers != file.has_attribute("/", "step"))
    file.refuse(where,
                integers ? "is missing beside integer samples" : "stands in a file without integer samples");
  if (!integers) return;
  v.step = file.reals("/", "step", 1).front();
  if (const auto p = step_problem(v)) file.refuse(p->where, p->what);
}

Certificate read_certificate(const std::string& path, const std::string& json) {
  try {
    return certificate_from_json(json);
  } catch (Error& e) {
    e.add_context(path + ": /certificate");
    throw;
  }
}

// --- content hash
// -----------------------------------------------------------------------------------------------------

template <class T>
void add(Sha256& hash, std::span<const T> values) {
  hash.update(values.data(), values.size_bytes());
}

void add_grid(Sha256& hash, const MixedVolume& v) {
  const auto cells = zyx(v.grid.cells);
  const auto origin = zyx(v.grid.origin), spacing = zyx(v.grid.spacing);
  add(hash, std::span<const std::int64_t>(cells));
  add(hash, std::span<const double>(origin));
  add(hash, std::span<const double>(spacing));
  // Unit texts hold no zero byte and the granularity ends in seven, so two different grids never give the
  // same bytes.
  hash.update(v.grid.unit.data(), v.grid.unit.size());
  const std::array<std::int64_t, 2> counts{v.granularity, v.rate};
  add(hash, std::span<const std::int64_t>(counts));
}

VdvrFile read_whole(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  const h5::Reader file(path);
  VdvrFile result;
  result.file_bytes = file.file_bytes();
  result.format_version = read_version(file);
  result.generator = file.text_attribute("/", "generator");
  read_grid(file, result.volume);
  const Contents contents = open_contents(file, result.volume);
  read_step(file, contents, result.volume);
  check_memory(file, path.string(), contents, max_memory_bytes);
  result.certificate_json = file.text("/certificate", std::min(longest_certificate, file.file_bytes()));
  result.certificate = read_certificate(path.string(), result.certificate_json);
  try {
    read_volume_data(file, contents, result.volume);
  } catch (const std::bad_alloc&) {
    throw ResourceError(
        fmt::format("{}: not enough memory for {} bytes of samples", path.string(), file.file_bytes()));
  }
  return result;
}

}  // namespace

std::string content_sha256(const MixedVolume& v) {
  Sha256 hash;
  add_grid(hash, v);
  const bool integers = has_integers(v);
  if (integers) hash.update(&v.step, sizeof v.step);
  hash.update(v.base.data(), v.base.bytes());
  add(hash, std::span<const LevelTriple>(v.level));
  add(hash, std::span<const std::uint32_t>(v.tile));
  for (const auto& [triple, block] : v.tiles) hash.update(block.data(), block.bytes());
  // The base's offset and shift are attributes: 64 bits.
  if (v.base.type != SampleType::f32) {
    const std::array<std::int64_t, 1> offset{v.base.offset.front()};
    add(hash, std::span<const std::int64_t>(offset));
  }
  for (const auto& [triple, block] : v.tiles) add(hash, std::span<const std::int32_t>(block.offset));
  if (v.base.type != SampleType::f32) {
    const std::array<std::int64_t, 1> shift{v.base.shift.front()};
    add(hash, std::span<const std::int64_t>(shift));
  }
  for (const auto& [triple, block] : v.tiles) add(hash, std::span<const std::uint8_t>(block.shift));
  return hash.hex();
}

void write_vdvr(const std::filesystem::path& path, const MixedVolume& v, const Certificate& certificate) {
  if (const auto p = volume_problem(v))
    throw InputError(fmt::format("{}: not written: {}: {}", path.string(), p->where, p->what));
  Certificate stored = certificate;
  if (stored.content_sha256.empty()) stored.content_sha256 = content_sha256(v);
  const std::string json = to_json(stored);

  io::AtomicFile target(path);
  {
    h5::Writer file(target.temporary(), path);
    file.attribute("/", "format", std::string("vdvr"));
    file.attribute("/", "format_version", std::int64_t{has_integers(v) ? 2 : 1});
    file.attribute("/", "generator", std::string("vdvr " VDVR_VERSION));
    if (has_integers(v)) file.attribute("/", "step", v.step);
    write_grid(file, v);
    write_block(file, "/base", base_shape(v), v.base);
    write_index(file, v);
    file.group("/tiles");
    for (const auto& [triple, samples] : v.tiles) {
      if (samples.size() == 0) continue;
      const auto side = v.tile_shape(triple);
      const auto count = static_cast<std::int64_t>(samples.size()) / v.tile_size(triple);
      write_block(file, path_of(triple), shape_of({count, side[0], side[1], side[2]}), samples);
    }
    file.text("/certificate", json);
    file.close();
  }
  target.commit();
}

VdvrFile read_vdvr(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  if (io::metadata_unchecked(path))
    io::rehearse(path, max_memory_bytes, [&] { static_cast<void>(read_whole(path, max_memory_bytes)); });
  return read_whole(path, max_memory_bytes);
}

bool is_vdvr(const std::filesystem::path& path) {
  const h5::Silence silence;
  const auto says_so = [&] {
    const h5::Reader file(path);
    return file.has_attribute("/", "format") && file.text_attribute("/", "format") == "vdvr";
  };
  try {
    if (io::metadata_unchecked(path)) io::rehearse(path, 0, [&] { static_cast<void>(says_so()); });
    return says_so();
  } catch (const Error&) {
    return false;
  }
}

}  // namespace vdvr
