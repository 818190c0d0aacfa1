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
#include <nlohmann/json.hpp>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/export/pack.hpp"
#include "host/volume/sampler/sample_box.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

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

void set_chunks(Level& level, const Index3& chunk) {
  for (std::size_t a = 0; a < 3; ++a) {
    level.chunk[a] = std::min(chunk[a], level.samples[a]);
    level.chunks[a] = (level.samples[a] + level.chunk[a] - 1) / level.chunk[a];
  }
}

Level level_of(const Grid& grid, const fs::path& folder, int log2_per_cell) {
  Level level{folder, log2_per_cell, fine_samples(grid, log2_per_cell), {}, {}};
  const std::int64_t side = chunk_side(level.samples);
  set_chunks(level, {side, side, side});
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

/// `grid` is that of the level at one sample a cell.
Json group_json(const Grid& grid, const ExportNote& note, const std::vector<Level>& levels,
                const std::string& name) {
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

Index3 number_of_chunk(const Level& level, std::int64_t i) {
  const Index3& n = level.chunks;
  return {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
}

/// What a chunk has of the array.
SampleBox box_of(const Level& level, const Index3& number) {
  SampleBox box;
  box.per_cell = {level.log2_per_cell, level.log2_per_cell, level.log2_per_cell};
  for (std::size_t a = 0; a < 3; ++a) {
    box.first[a] = number[a] * level.chunk[a];
    box.count[a] = std::min(level.chunk[a], level.samples[a] - box.first[a]);
  }
  return box;
}

/// One chunk, which `fill(box, samples)` puts into zeros; its bytes on disk.
template <class Fill>
std::uint64_t write_chunk(const Level& level, const Index3& number, Compression compression,
                          const fs::path& shown, Fill&& fill) {
  std::vector<float> samples(at(level.chunk[0] * level.chunk[1] * level.chunk[2]));
  fill(box_of(level, number), samples.data());
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

/// One level, from planes. Chunks are as deep as planes are kept for.
class ZarrSink : public VolumeSink {
 public:
  ZarrSink(const fs::path& path, const ExportNote& note, Compression compression, std::uint64_t most_bytes)
      : path_(path), note_(note), compression_(compression), folder_(path) {
    const Index3 n = note.grid.samples();
    const std::uint64_t bytes = io::checked_bytes(n, sizeof(float), path.string());
    level_ = {folder_.temporary() / "0", 0, n, {}, {}};
    // Where planes are large a chunk has fewer of them, and more of each.
    const std::int64_t side = chunk_side(n);
    const auto plane = static_cast<std::uint64_t>(n[0] * n[1]) * sizeof(float);
    std::int64_t depth = side, width = side;
    for (; depth > 1 && static_cast<std::uint64_t>(depth) * plane > most_bytes; depth /= 4) width *= 2;
    set_chunks(level_, {width, width, std::max<std::int64_t>(depth, 1)});
    if (compression == Compression::none) require_disk(path, folder_.temporary(), bytes);
    make_folders(level_, path);
  }
  [[nodiscard]] std::int64_t planes_together() const override { return level_.chunk[2]; }

  void put(std::int64_t first, std::span<const std::byte> planes) override {
    const auto* samples = reinterpret_cast<const float*>(planes.data());
    const Index3 &n = level_.samples, &along = level_.chunks;
    const std::int64_t row = n[0], plane = n[0] * n[1],
                       depth = static_cast<std::int64_t>(planes.size() / sizeof(float)) / plane,
                       layers = (depth + level_.chunk[2] - 1) / level_.chunk[2];
    parallel_for(layers * along[0] * along[1], {}, "export", [&](std::int64_t i) {
      Index3 number = number_of_chunk(level_, i);
      number[2] += first / level_.chunk[2];
      bytes_ += write_chunk(level_, number, compression_, path_, [&](const SampleBox& box, float* out) {
        for (std::int64_t z = 0; z < box.count[2]; ++z)
          for (std::int64_t y = 0; y < box.count[1]; ++y)
            std::copy_n(
                samples + (box.first[2] - first + z) * plane + (box.first[1] + y) * row + box.first[0],
                box.count[0], out + (z * level_.chunk[1] + y) * level_.chunk[0]);
      });
    });
  }
  std::uint64_t commit() override {
    write_json(level_.folder / "zarr.json", path_, array_json(level_, compression_));
    write_json(folder_.temporary() / "zarr.json", path_,
               group_json(note_.grid, note_, {level_}, path_.stem().string()));
    folder_.commit();
    return bytes_;
  }

 private:
  fs::path path_;
  ExportNote note_;
  Compression compression_;
  io::AtomicFolder folder_;
  Level level_;
  std::atomic<std::uint64_t> bytes_{0};
};

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
    const Index3& n = level.chunks;
    const double share = static_cast<double>(level.samples[0] * level.samples[1] * level.samples[2]) /
                         static_cast<double>(totals.samples);
    const Progress part = [&](const std::string& stage, double fraction) {
      report(progress, stage, done + share * fraction);
    };
    parallel_for(n[0] * n[1] * n[2], part, "export", [&](std::int64_t i) {
      bytes +=
          write_chunk(level, number_of_chunk(level, i), compression, path, [&](SampleBox box, float* out) {
            box.end_brick = v.bricks();
            sample_box(v, box, level.chunk[0], level.chunk[0] * level.chunk[1], out);
          });
    });
    done += share;
  }
  write_json(folder.temporary() / "zarr.json", path, group_json(v.grid, note, levels, path.stem().string()));
  folder.commit();
  totals.bytes = bytes;
  return totals;
}

std::unique_ptr<VolumeSink> ome_zarr_sink(const fs::path& path, const ExportNote& note,
                                          Compression compression, std::uint64_t most_bytes) {
  return std::make_unique<ZarrSink>(path, note, compression, most_bytes);
}

}  // namespace vdvr
