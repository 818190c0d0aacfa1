// Metadata: the OME-Zarr specification 0.5 (multiscales, axes, scale before translation) over the Zarr core
// specification 3 (regular chunks, default keys, codecs bytes and gzip, which every implementation must
// have).
#include "host/export/ome_zarr.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <map>

#include "host/export/pack.hpp"
#include "host/export/sample_box.hpp"
#include "host/export/volume_sink.hpp"
#include "host/system/casts.hpp"
#include "host/system/limits.hpp"
#include "host/system/parallel.hpp"
#include "vdvr/error.hpp"
#include "vdvr/output_file.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int gzip_level = 4;

struct Level {
  fs::path folder;
  int log2_per_cell = 0;
  Index3 samples{}, chunk{}, chunks{};  // x, y, z
};

/// 1 MiB, or 8 MiB where that would make very many files.
std::int64_t chunk_side(const Index3& samples) {
  constexpr double many = 0x1p30;
  const double count =
      static_cast<double>(samples[0]) * static_cast<double>(samples[1]) * static_cast<double>(samples[2]);
  return count > many ? 128 : 64;
}

Level level_of(const Grid& grid, const fs::path& folder, int log2_per_cell) {
  Level level{folder, log2_per_cell, fine_samples(grid, log2_per_cell), {}, {}};
  const std::int64_t side = chunk_side(level.samples);
  for (std::size_t a = 0; a < 3; ++a) {
    level.chunk[a] = std::min(side, level.samples[a]);
    level.chunks[a] = (level.samples[a] + level.chunk[a] - 1) / level.chunk[a];
  }
  return level;
}

Json zyx(const auto& v) { return Json{v[2], v[1], v[0]}; }

Json array_json(const Level& level, Compression compression) {
  Json codecs = Json::array();
  codecs.push_back({{"name", "bytes"}, {"configuration", {{"endian", "little"}}}});
  if (compression == Compression::deflate)
    codecs.push_back({{"name", "gzip"}, {"configuration", {{"level", gzip_level}}}});
  return {{"zarr_format", 3},
          {"node_type", "array"},
          {"shape", zyx(level.samples)},
          {"data_type", "float32"},
          {"chunk_grid", {{"name", "regular"}, {"configuration", {{"chunk_shape", zyx(level.chunk)}}}}},
          {"chunk_key_encoding", {{"name", "default"}, {"configuration", {{"separator", "/"}}}}},
          {"fill_value", 0.0},
          {"codecs", codecs},
          {"attributes", Json::object()},
          {"dimension_names", {"z", "y", "x"}}};
}

/// UDUNITS-2's names, of which the specification has a list; a pixel has none.
Json axis_json(const char* name, const std::string& unit) {
  static const std::map<std::string, std::string> names{
      {"pm", "picometer"},       {"nm", "nanometer"},  {"um", "micrometer"},
      {"\u00b5m", "micrometer"}, {"mm", "millimeter"}, {"cm", "centimeter"},
      {"dm", "decimeter"},       {"m", "meter"},       {"in", "inch"}};
  Json axis = {{"name", name}, {"type", "space"}};
  if (const auto found = names.find(unit); found != names.end()) axis["unit"] = found->second;
  return axis;
}

Json group_json(const VdvrFile& file, const ExportNote& note, const std::vector<Level>& levels,
                const std::string& name) {
  const Grid& grid = file.volume.grid;
  Json datasets = Json::array();
  for (const Level& level : levels) {
    Vec3 spacing = grid.spacing;
    for (double& s : spacing) s = std::ldexp(s, -level.log2_per_cell);
    datasets.push_back({{"path", level.folder.filename().string()},
                        {"coordinateTransformations",
                         {{{"type", "scale"}, {"scale", zyx(spacing)}},
                          {{"type", "translation"}, {"translation", zyx(grid.origin)}}}}});
  }
  const Json multiscale = {
      {"name", name},
      {"axes", {axis_json("z", grid.unit), axis_json("y", grid.unit), axis_json("x", grid.unit)}},
      {"datasets", datasets},
      {"type", "samples of the same continuous field"},
      {"metadata",
       {{"description", "each level holds the field at its own sample points; nothing is averaged"},
        {"method", "vdvr export"},
        {"version", VDVR_VERSION}}}};
  return {{"zarr_format", 3},
          {"node_type", "group"},
          {"attributes",
           {{"ome", {{"version", "0.5"}, {"multiscales", Json::array({multiscale})}}},
            {"vdvr", certificate_note(note)}}}};
}

void write_bytes(const fs::path& path, const fs::path& shown, std::span<const std::byte> bytes) {
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) throw ResourceError(fmt::format("{}: cannot be written; is the disk full?", shown.string()));
}

void write_json(const fs::path& path, const fs::path& shown, const Json& json) {
  const std::string text = json.dump(2) + "\n";
  write_bytes(path, shown, std::as_bytes(std::span(text)));
}

/// One chunk, zeros beyond the array; its bytes on disk.
std::uint64_t write_chunk(const MixedVolume& v, const Level& level, const Index3& number,
                          Compression compression, const fs::path& shown) {
  SampleBox box;
  box.per_cell = {level.log2_per_cell, level.log2_per_cell, level.log2_per_cell};
  box.end_brick = v.bricks();
  for (std::size_t a = 0; a < 3; ++a) {
    box.first[a] = number[a] * level.chunk[a];
    box.count[a] = std::min(level.chunk[a], level.samples[a] - box.first[a]);
  }
  std::vector<float> samples(at(level.chunk[0] * level.chunk[1] * level.chunk[2]));
  sample_box(v, box, level.chunk[0], level.chunk[0] * level.chunk[1], samples.data());
  const auto raw = std::as_bytes(std::span<const float>(samples));
  const fs::path file =
      level.folder / "c" / std::to_string(number[2]) / std::to_string(number[1]) / std::to_string(number[0]);
  if (compression == Compression::none) {
    write_bytes(file, shown, raw);
    return raw.size();
  }
  const Bytes bytes = packed(raw, Wrapper::gzip, gzip_level);
  write_bytes(file, shown, bytes);
  return bytes.size();
}

void make_folders(const Level& level, const fs::path& shown) {
  std::error_code error;
  for (std::int64_t z = 0; !error && z < level.chunks[2]; ++z)
    for (std::int64_t y = 0; !error && y < level.chunks[1]; ++y)
      fs::create_directories(level.folder / "c" / std::to_string(z) / std::to_string(y), error);
  if (error) throw ResourceError(fmt::format("{}: cannot be written: {}", shown.string(), error.message()));
}

}  // namespace

ZarrTotals write_ome_zarr(const VdvrFile& file, const fs::path& path, const ExportNote& note, int finest,
                          const ExportOptions& options, const Progress& progress) {
  const MixedVolume& v = file.volume;
  const Compression compression = options.compression;
  io::AtomicFolder folder(path);
  std::vector<Level> levels;
  ZarrTotals totals;
  for (int k = finest; k >= 0; --k) {
    levels.push_back(level_of(v.grid, folder.temporary() / std::to_string(finest - k), k));
    totals.samples += io::checked_bytes(levels.back().samples, sizeof(float), path.string()) / sizeof(float);
  }
  if (compression == Compression::none)
    require_disk(path, folder.temporary(), totals.samples * sizeof(float));
  // Samples of a chunk, and what they pack to, which may be a little more.
  const Index3 largest = levels.front().chunk;
  const auto chunk_bytes = static_cast<std::uint64_t>(largest[0] * largest[1] * largest[2]) * sizeof(float);
  require_memory_of_cores(v, 2 * chunk_bytes + chunk_bytes / 8, 0, options.max_memory_bytes, path.string());
  std::atomic<std::uint64_t> bytes{0};
  double done = 0;
  for (const Level& level : levels) {
    make_folders(level, path);
    write_json(level.folder / "zarr.json", path, array_json(level, compression));
    const Index3 n = level.chunks;
    const double share = static_cast<double>(level.samples[0] * level.samples[1] * level.samples[2]) /
                         static_cast<double>(totals.samples);
    const Progress part = [&](const std::string& stage, double fraction) {
      report(progress, stage, done + share * fraction);
    };
    parallel_for(n[0] * n[1] * n[2], part, "export", [&](std::int64_t i) {
      bytes += write_chunk(v, level, {i % n[0], i / n[0] % n[1], i / n[0] / n[1]}, compression, path);
    });
    done += share;
  }
  write_json(folder.temporary() / "zarr.json", path, group_json(file, note, levels, path.stem().string()));
  folder.commit();
  totals.bytes = bytes;
  return totals;
}

}  // namespace vdvr
