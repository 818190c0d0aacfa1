// Reads the .vdvr file (docs/file-format.md), only after everything in it has been checked.
#include "host/volume/vdvr_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>

#include "host/base/system/limits.hpp"
#include "host/base/system/read_in_child.hpp"
#include "host/files/hdf5/hdf5_reader.hpp"
#include "host/volume/seal.hpp"
#include "host/volume/validate_volume.hpp"
#include "host/volume/vdvr_layout.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

namespace h5 = io::hdf5;

constexpr std::uint64_t longest_certificate = 64u << 20;

std::string text_of(const h5::Shape& shape) { return fmt::format("[{}]", fmt::join(shape, ", ")); }

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

void read_grid(const h5::Reader& file, int version, MixedVolume& v) {
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
  if (version >= 4) {
    const auto coarsening = file.integers("/grid", "coarsening", 3);
    for (std::size_t a = 0; a < 3; ++a)
      v.coarsening[a] = static_cast<std::uint8_t>(std::clamp<std::int64_t>(coarsening[a], 0, 255));
    if (wide(v.coarsening) != std::array{coarsening[0], coarsening[1], coarsening[2]})
      file.refuse("attribute 'coarsening' of /grid",
                  fmt::format("is {}, expected 0 to 3", fmt::join(coarsening, ", ")));
  }
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

TileKind kind_of(const h5::Reader& file, const std::string& name) {
  const std::string triple = name.substr(0, 3);
  const bool digits = triple.size() == 3 && triple != "000" &&
                      std::all_of(triple.begin(), triple.end(), [](char c) { return c >= '0' && c <= '6'; });
  const bool part = name.size() == 5 && name[3] == '_' && name[4] >= '1' && name[4] < '0' + most_parts;
  if (!digits || (name.size() != 3 && !part))
    file.refuse("/tiles/" + name,
                "is not named by a level triple, three digits z, y, x such as 111 or 021, and for tiles of a "
                "second or third type _1 or _2");
  TileKind kind;
  for (std::size_t a = 0; a < 3; ++a) kind.level[a] = static_cast<std::uint8_t>(name[a] - '0');
  if (part) kind.part = static_cast<std::uint8_t>(name[4] - '0');
  return kind;
}

const std::vector<h5::Element> kSampleElements{h5::Element::f32, h5::Element::u16, h5::Element::u8};

/// All datasets of one file, checked but not yet read.
struct Contents {
  h5::Dataset base, level, tile;
  std::map<TileKind, h5::Dataset> tiles, offsets, shifts;
  std::map<TileKind, std::uint64_t> counts;
};

SampleType type_of(const h5::Dataset& d) {
  return d.element == h5::Element::f32   ? SampleType::f32
         : d.element == h5::Element::u16 ? SampleType::u16
                                         : SampleType::u8;
}

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
  std::vector<std::string> tables;
  for (const std::string& name : file.members("/tiles")) {
    if (name.ends_with("_offset") || name.ends_with("_shift")) {
      tables.push_back(name.substr(0, name.rfind('_')));
      continue;
    }
    const TileKind l = kind_of(file, name);
    if (!is_within_rate(v, l.level))
      file.refuse(path_of(l), fmt::format("is beyond rate {}, which ends at level {}", v.rate,
                                          fmt::join(finest_level(v.rate, v.coarsening), ", ")));
    const auto side = v.tile_shape(l);
    c.tiles[l] = expect(file, path_of(l), kSampleElements, shape_of({0, side[0], side[1], side[2]}));
    c.counts[l] = c.tiles[l].shape.front();
    if (c.counts[l] > c.tile.count)
      file.refuse(path_of(l), fmt::format("{} tiles for {} bricks", c.counts[l], c.tile.count));
  }
  std::map<TileKind, SampleType> types;
  for (const auto& [kind, d] : c.tiles) types[kind] = type_of(d);
  if (const auto p = parts_problem(types)) file.refuse(p->where, p->what);
  open_tables(file, c);
  for (const std::string& name : tables) {
    const auto found = c.offsets.find(kind_of(file, name));
    if (found == c.offsets.end())
      file.refuse("/tiles/" + name + "_offset or _shift", "belongs to no integer tiles of that name");
  }
  return c;
}

/// Limits of a reading.
struct Reading {
  std::uint64_t max_memory_bytes = 0;  ///< 0: none
  std::optional<std::filesystem::path> scratch_folder;
  std::shared_ptr<Scratch> scratch;  ///< where samples lie; none: in memory

  [[nodiscard]] std::shared_ptr<Scratch> for_block(const h5::Dataset& d) const {
    return d.bytes > max_memory_bytes / 64 ? scratch : nullptr;
  }
};

/// Samples of more than a quarter of the limit: whoever draws them needs most of it.
void choose_scratch(const Contents& c, Reading& reading) {
  std::uint64_t bytes = c.base.bytes;
  for (const auto& [triple, d] : c.tiles) bytes += d.bytes;
  if (reading.scratch_folder && bytes > reading.max_memory_bytes / 4)
    reading.scratch = scratch_for(bytes, reading.max_memory_bytes, *reading.scratch_folder);
}

/// Memory by declared sizes, before any of it is taken.
void check_memory(const h5::Reader& file, const std::string& path, const Contents& c,
                  const Reading& reading) {
  const std::uint64_t max_memory_bytes = reading.max_memory_bytes;
  const auto in_memory = [&](const h5::Dataset& d) { return reading.for_block(d) ? 0 : d.bytes; };
  std::uint64_t stored = c.base.stored_bytes + c.level.stored_bytes + c.tile.stored_bytes;
  std::uint64_t needed = in_memory(c.base) + c.level.bytes + c.tile.bytes + c.tile.count / 8;
  if (reading.scratch) needed += reading.scratch->resident_bytes();
  std::uint64_t for_chunks = std::max({c.base.chunk_memory, c.level.chunk_memory, c.tile.chunk_memory});
  for (const auto* datasets : {&c.tiles, &c.offsets, &c.shifts})
    for (const auto& [triple, d] : *datasets) {
      stored += d.stored_bytes;
      needed += datasets == &c.tiles ? in_memory(d) : d.bytes;
      for_chunks = std::max(for_chunks, d.chunk_memory);
    }
  needed += for_chunks;
  if (stored > file.file_bytes())
    file.refuse(
        "/", fmt::format("datasets claim {} bytes in a file of {}: they overlap", stored, file.file_bytes()));
  if (max_memory_bytes != 0 && needed > max_memory_bytes)
    throw ResourceError(
        fmt::format("{}: reading needs {} bytes of memory, {} are allowed: raise `max_memory`", path, needed,
                    max_memory_bytes));
  io::require_memory(needed, 0, path);  // deflated, a small file may hold a large volume
}

void read_samples(const h5::Reader& file, const h5::Dataset& d, const Reading& reading, SampleBlock& b) {
  const auto into = [&](auto& samples) {
    if (auto scratch = reading.for_block(d))
      samples = {static_cast<std::size_t>(d.count), std::move(scratch), d.name};
    else samples.resize(d.count);
    file.read(d, samples.data());
  };
  b.type = type_of(d);
  if (b.type == SampleType::f32) into(b.f32);
  else if (b.type == SampleType::u16) into(b.u16);
  else into(b.u8);
}

/// Bounds by brick, where the file has them; none is above what the certificate promises of all.
void read_totals(const h5::Reader& file, const MixedVolume& v, Certificate& c) {
  if (!file.has(kTotals)) return;
  const Index3 b = v.bricks();
  const h5::Dataset d = expect(file, kTotals, {h5::Element::f32}, shape_of({b[2], b[1], b[0]}));
  c.brick_totals.resize(d.count);
  file.read(d, c.brick_totals.data());
  const double most = c.measured_total * (1 + 0x1p-20);
  for (const float total : c.brick_totals)
    if (!(static_cast<double>(total) <= most))
      file.refuse(kTotals, fmt::format("holds {}, above the certificate's measured_total {}", total,
                                       c.measured_total));
}

/// Sigma of F by brick, where the certificate speaks of it.
void read_sigma(const h5::Reader& file, const MixedVolume& v, Certificate& c) {
  if (!c.noise) return;
  const Index3 b = v.bricks();
  const h5::Dataset d = expect(file, kSigma, {h5::Element::f32}, shape_of({b[2], b[1], b[0]}));
  c.brick_sigma.resize(d.count);
  file.read(d, c.brick_sigma.data());
  for (const float sigma : c.brick_sigma)
    if (!(sigma > 0) || !std::isfinite(sigma))
      file.refuse(kSigma, fmt::format("holds {}; a standard deviation is positive", sigma));
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

/// Offsets and shifts of integer tiles.
void read_table(const h5::Reader& file, const Contents& c, const TileKind& kind, SampleBlock& b) {
  if (b.type == SampleType::f32) return;
  b.offset.resize(c.counts.at(kind));
  b.shift.resize(c.counts.at(kind));
  file.read(c.offsets.at(kind), b.offset.data());
  file.read(c.shifts.at(kind), b.shift.data());
}

void read_index(const h5::Reader& file, const Contents& c, MixedVolume& v) {
  v.level.resize(c.tile.count);
  file.read(c.level, v.level.data());
  v.tile.resize(c.tile.count);
  file.read(c.tile, v.tile.data());
  if (const auto p = index_problem(v, c.counts)) file.refuse(p->where, p->what);
}

void read_volume_data(const h5::Reader& file, const Contents& c, const Reading& reading, MixedVolume& v) {
  read_index(file, c, v);
  read_samples(file, c.base, reading, v.base);
  if (v.base.type != SampleType::f32) read_base_table(file, v.base);
  for (const auto& [triple, d] : c.tiles) {
    SampleBlock& b = v.tiles[triple];
    read_samples(file, d, reading, b);
    read_table(file, c, triple, b);
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

/// The certificate, or the record of a comparison; earlier versions kept that as a certificate which says so.
Certificate read_certificate(const h5::Reader& file, const std::string& path, std::string& json) {
  const bool record = file.has(kComparison);
  if (record && file.has(kCertificate))
    file.refuse(kComparison, "stands beside a certificate, and only one of them can speak of the volume");
  const char* name = record ? kComparison : kCertificate;
  json = file.text(name, std::min(longest_certificate, file.file_bytes()));
  Certificate c;
  try {
    c = certificate_from_json(json);
  } catch (Error& e) {
    e.add_context(path + ": " + name);
    throw;
  }
  if (record && !c.comparison) file.refuse(kComparison, "does not say that it is a comparison");
  return c;
}

// --- seal ---

/// Of all objects that a reader looks at. Paths of /tiles come after "/tiles" itself.
std::vector<h5::Attribute> all_attributes(const h5::Reader& file) {
  std::vector<std::string> objects{"/"};
  for (const char* path :
       {"/base", kTotals, kSigma, kCertificate, kComparison, "/grid", "/level", "/tile", "/tiles"})
    if (file.has(path)) objects.emplace_back(path);
  if (file.has("/tiles"))
    for (const std::string& name : file.members("/tiles")) objects.push_back("/tiles/" + name);
  std::vector<h5::Attribute> all;
  for (const std::string& object : objects) {
    const auto some = file.attributes(object);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

/// What is wrong with the seal; empty where nothing is, or where the file is unsealed.
std::string read_seal(const h5::Reader& file, VdvrFile& result) {
  const bool present = file.has_attribute("/", kSeal);
  if (!present && !result.certificate.sealed) return {};
  result.seal = Seal::broken;
  if (!present)
    return "the seal is broken: the certificate says that the file is sealed, and the seal is gone";
  const std::string stored = file.text_attribute("/", kSeal);
  const std::string found =
      seal_of(result.certificate_json, result.certificate.brick_totals, all_attributes(file));
  if (stored != found)
    return fmt::format(
        "the seal is broken: certificate, totals by brick and attributes have sha256 {}, the seal says {}",
        found, stored.substr(0, 64));
  const Certificate& c = result.certificate;
  if (c.noise && sigma_sha256(c.brick_sigma) != c.noise->sha256)
    return fmt::format("the seal is broken: {} is not what the certificate was issued with", kSigma);
  if (!result.certificate.sealed)
    return "the seal is broken: there is one, but the certificate does not say so";
  result.seal = Seal::whole;
  return {};
}

/// What was altered, in one line.
std::string read_altered(const h5::Reader& file, VdvrFile& result) {
  std::string altered = read_seal(file, result);
  const std::string found = content_sha256(result.volume);
  if (found == result.certificate.content_sha256) return altered;
  return fmt::format(
      "{}{}the content does not match its hash: it has sha256 {}, but its certificate was issued for {}",
      altered, altered.empty() ? "" : "; ", found, result.certificate.content_sha256);
}

/// Everything before the certificate and the samples.
Contents read_head(const h5::Reader& file, VdvrFile& result) {
  result.file_bytes = file.file_bytes();
  result.format_version = read_version(file);
  result.generator = file.text_attribute("/", "generator");
  read_grid(file, result.format_version, result.volume);
  Contents contents = open_contents(file, result.volume);
  read_step(file, contents, result.volume);
  return contents;
}

VdvrFile read_whole(const std::filesystem::path& path, Reading reading) {
  const h5::Reader file(path, h5::Links::hard);
  VdvrFile result;
  const Contents contents = read_head(file, result);
  choose_scratch(contents, reading);
  check_memory(file, path.string(), contents, reading);
  result.certificate = read_certificate(file, path.string(), result.certificate_json);
  try {
    read_volume_data(file, contents, reading, result.volume);
    read_totals(file, result.volume, result.certificate);
    read_sigma(file, result.volume, result.certificate);
  } catch (const std::bad_alloc&) {
    throw ResourceError(fmt::format("{}: not enough memory for the samples in its {} bytes", path.string(),
                                    file.file_bytes()));
  }
  result.altered = read_altered(file, result);
  return result;
}

}  // namespace

const char* text_of(Seal seal) {
  switch (seal) {
    case Seal::none:
      return "unsealed";
    case Seal::whole:
      return "sealed";
    case Seal::broken:
      break;
  }
  return "BROKEN SEAL";
}

namespace {

VdvrFile read_checked(const std::filesystem::path& path, const Reading& reading, Altered altered) {
  if (io::metadata_unchecked(path))
    // Scratch files take addresses, not memory.
    io::read_in_child(path, reading.scratch_folder ? 0 : reading.max_memory_bytes,
                      [&] { static_cast<void>(read_whole(path, reading)); });
  VdvrFile file = read_whole(path, reading);
  if (altered == Altered::refuse && !file.altered.empty())
    throw MismatchError(fmt::format("{}: {}; build it again", path.string(), file.altered));
  return file;
}

}  // namespace

VdvrFile read_vdvr(const std::filesystem::path& path, std::uint64_t max_memory_bytes, Altered altered) {
  return read_checked(path, {max_memory_bytes, std::nullopt, nullptr}, altered);
}

VdvrFile read_large_vdvr(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                         const std::filesystem::path& scratch, Altered altered) {
  return read_checked(path, {max_memory_bytes, scratch, nullptr}, altered);
}

VdvrParts open_parts(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  if (io::metadata_unchecked(path))
    io::read_in_child(path, max_memory_bytes, [&] {
      static_cast<void>(read_whole(path, {max_memory_bytes, std::nullopt, nullptr}));
    });
  VdvrParts parts;
  parts.reader = std::make_unique<h5::Reader>(path, h5::Links::hard);
  const h5::Reader& file = *parts.reader;
  VdvrFile& result = parts.file;
  MixedVolume& v = result.volume;
  Contents contents = read_head(file, result);
  result.certificate = read_certificate(file, path.string(), result.certificate_json);
  read_index(file, contents, v);
  v.base.type = type_of(contents.base);
  if (v.base.type != SampleType::f32) read_base_table(file, v.base);
  for (const auto& [kind, d] : contents.tiles) {
    SampleBlock& b = v.tiles[kind];
    b.type = type_of(d);
    read_table(file, contents, kind, b);
  }
  read_totals(file, v, result.certificate);
  read_sigma(file, v, result.certificate);
  result.altered = read_seal(file, result);
  if (!result.altered.empty())
    throw MismatchError(fmt::format("{}: {}; build it again", path.string(), result.altered));
  parts.base = std::move(contents.base);
  parts.tiles = std::move(contents.tiles);
  return parts;
}

bool is_vdvr(const std::filesystem::path& path) {
  const h5::Silence silence;
  const auto says_so = [&] {
    const h5::Reader file(path, h5::Links::hard);
    return file.has_attribute("/", "format") && file.text_attribute("/", "format") == "vdvr";
  };
  try {
    if (io::metadata_unchecked(path)) io::read_in_child(path, 0, [&] { static_cast<void>(says_so()); });
    return says_so();
  } catch (const Error&) {
    return false;
  }
}

}  // namespace vdvr
