// Slab by slab: V is sampled on all cores, turned into the file's type, and handed to the format's sink. What
// was exported is never whole in memory.
#include "vdvr/export_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <tuple>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/lower.hpp"
#include "host/base/system/parallel.hpp"
#include "host/export/hdf5_sink.hpp"
#include "host/export/ome_zarr.hpp"
#include "host/export/tiff_sink.hpp"
#include "host/export/volume_sink.hpp"
#include "host/volume/sampler/sample_box.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/export_vtk.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

struct Name {
  ExportFormat format;
  const char* text;
};
constexpr std::array<Name, 8> format_names{{{ExportFormat::mha, "mha"},
                                            {ExportFormat::nrrd, "nrrd"},
                                            {ExportFormat::npy, "npy"},
                                            {ExportFormat::raw, "raw"},
                                            {ExportFormat::tiff, "tiff"},
                                            {ExportFormat::hdf5, "hdf5"},
                                            {ExportFormat::ome_zarr, "ome-zarr"},
                                            {ExportFormat::vtm, "vtm"}}};

/// "slices/" and "slices" name one folder.
fs::path without_slash(const fs::path& path) { return path.has_filename() ? path : path.parent_path(); }

// --- what may be replaced ---

/// Whether an entry of a folder is of those that an export of the format puts there.
bool is_ours(const std::string& name, ExportFormat format) {
  const auto digits = [](const std::string& s) {
    return !s.empty() && std::all_of(s.begin(), s.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  const auto between = [&](const std::string& front, const std::string& back) {
    return name.size() > front.size() + back.size() && name.starts_with(front) && name.ends_with(back) &&
           digits(name.substr(front.size(), name.size() - front.size() - back.size()));
  };
  if (format == ExportFormat::tiff) return name == "volume.json" || between("slice_", ".tif");
  if (format == ExportFormat::vtm) return between("block_", ".vti");
  return name == "zarr.json" || (name.size() == 1 && digits(name));
}

/// Whether an export is a folder.
bool is_folder(const fs::path& path, ExportFormat format) {
  return format == ExportFormat::ome_zarr || (format == ExportFormat::tiff && !is_tiff_file_name(path));
}

/// A folder in the way is replaced only where nothing else would go with it.
void require_replaceable(const fs::path& folder, ExportFormat format) {
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  if (!fs::is_directory(folder, error))
    throw InputError(fmt::format("{}: is a file, where a folder is to be written", folder.string()));
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const std::string name = entry.path().filename().string(); !is_ours(name, format))
      throw InputError(
          fmt::format("{}: holds '{}', which no export put there; choose another folder, or remove it",
                      folder.string(), name));
}

// --- samples ---

/// Integers of a slab, counting what lies outside.
class Encoder {
 public:
  explicit Encoder(const ExportNote& note) : note_(note) {}

  /// In place of nothing for float32: the samples themselves.
  std::span<const std::byte> operator()(std::span<const float> samples) {
    if (note_.samples == SampleType::f32) return std::as_bytes(samples);
    bytes_.resize(samples.size() * bytes_of(note_.samples));
    constexpr std::int64_t piece = 1 << 18;
    const auto count = static_cast<std::int64_t>(samples.size());
    parallel_for((count + piece - 1) / piece, {}, "export", [&](std::int64_t i) {
      const auto part = samples.subspan(at(i * piece), at(std::min(piece, count - i * piece)));
      if (note_.samples == SampleType::u16) encode<std::uint16_t>(part, at(i * piece));
      else encode<std::uint8_t>(part, at(i * piece));
    });
    return bytes_;
  }
  [[nodiscard]] std::uint64_t clipped() const { return clipped_; }

 private:
  template <class T>
  void encode(std::span<const float> samples, std::size_t first) {
    auto* out = reinterpret_cast<T*>(bytes_.data()) + first;
    constexpr double top = std::numeric_limits<T>::max();
    std::uint64_t outside = 0;
    for (const float s : samples) {
      const double code = std::nearbyint((static_cast<double>(s) - note_.offset) / note_.scale);
      outside += code < 0 || code > top;
      *out++ = static_cast<T>(std::clamp(code, 0.0, top));
    }
    clipped_ += outside;
  }

  ExportNote note_;
  std::vector<std::byte> bytes_;
  std::atomic<std::uint64_t> clipped_{0};
};

void set_scale(ExportNote& note, const ExportOptions& options) {
  note.samples = options.samples;
  if (options.samples == SampleType::f32) return;
  const auto [lo, hi] = options.range ? *options.range : std::pair{note.lowest, note.highest};
  const double top = std::ldexp(1.0, static_cast<int>(8 * bytes_of(options.samples))) - 1;
  note.offset = lo;
  note.scale = hi > lo ? (hi - lo) / top : 1;
}

/// Of planes that wait for others.
std::uint64_t kept_bytes(const ExportOptions& options) {
  const std::uint64_t most = std::uint64_t{64} << 20;
  return options.max_memory_bytes > 0 ? std::min(most, options.max_memory_bytes / 16) : most;
}

/// Planes that a slab has: as many as 64 MiB hold, or as memory leaves.
std::int64_t slab_planes(const MixedVolume& v, const Grid& grid, const ExportOptions& options,
                         std::int64_t together, const std::string& name) {
  const Index3 n = grid.samples();
  const std::array<std::int64_t, 2> plane{n[0], n[1]};
  // As float32, and beside that as what the file has.
  const std::uint64_t bytes = io::checked_bytes(plane, sizeof(float) + bytes_of(options.samples), name);
  std::uint64_t room = std::uint64_t{64} << 20;
  if (options.max_memory_bytes > 0) {
    const std::uint64_t held = resident_bytes(v), least = bytes * static_cast<std::uint64_t>(together);
    io::require_memory(held + least, options.max_memory_bytes,
                       name + ": the volume and a few planes of samples");
    room = std::min(room, options.max_memory_bytes - held);
  }
  // Whole bricks, where there is room for them.
  const auto planes = static_cast<std::int64_t>(room / bytes);
  const std::int64_t brick = std::int64_t{v.granularity} * options.oversampling;
  const std::int64_t step = std::lcm(brick, together);
  if (planes >= step) return std::min(planes / step * step, (n[2] + step - 1) / step * step);
  return std::max(planes / together, std::int64_t{1}) * together;
}

std::unique_ptr<VolumeSink> sink_of(const fs::path& path, const ExportNote& note,
                                    const ExportOptions& options) {
  switch (options.format) {
    case ExportFormat::mha:
    case ExportFormat::nrrd:
      return raster_sink(path, note);
    case ExportFormat::npy:
      return flat_sink(path, note, true);
    case ExportFormat::raw:
      return flat_sink(path, note, false);
    case ExportFormat::hdf5:
      return hdf5_sink(path, note, options.compression);
    case ExportFormat::ome_zarr:
      return ome_zarr_sink(without_slash(path), note, options.compression, kept_bytes(options));
    default:
      break;
  }
  if (is_tiff_file_name(path)) return tiff_pages_sink(path, note);
  return tiff_folder_sink(without_slash(path), note);
}

std::uint64_t write_slabs(const MixedVolume& v, const fs::path& path, const ExportNote& note,
                          const ExportOptions& options, int log2_per_cell, std::uint64_t& clipped,
                          const Progress& progress) {
  const Index3 n = note.grid.samples();
  const auto sink = sink_of(path, note, options);
  const std::int64_t depth = slab_planes(v, note.grid, options, sink->planes_together(), path.string());
  std::vector<float> slab(at(n[0] * n[1] * std::min(depth, n[2])));
  Encoder encode(note);
  for (std::int64_t z = 0; z < n[2]; z += depth) {
    throw_if_stopped();
    report(progress, "export", static_cast<double>(z) / static_cast<double>(n[2]));
    const std::int64_t planes = std::min(depth, n[2] - z);
    sample_box_parallel(v, planes_of(v, log2_per_cell, z, planes), slab.data());
    sink->put(z, encode({slab.data(), at(n[0] * n[1] * planes)}));
  }
  clipped = encode.clipped();
  throw_if_stopped();
  return sink->commit();
}

// --- options ---

Grid finer(const Grid& grid, int oversampling) {
  Grid result = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    result.cells[a] *= oversampling;
    result.spacing[a] /= oversampling;
  }
  return result;
}

void check_options(const fs::path& path, const ExportOptions& o) {
  if (o.oversampling < 1 || o.oversampling > 64 ||
      !std::has_single_bit(static_cast<unsigned>(o.oversampling)))
    throw InputError(fmt::format("oversampling {} is no power of two from 1 to 64", o.oversampling));
  const bool typed = o.format == ExportFormat::npy || o.format == ExportFormat::raw ||
                     o.format == ExportFormat::tiff || o.format == ExportFormat::hdf5;
  if (o.samples != SampleType::f32 && !typed)
    throw InputError(fmt::format("{}: {} is written as f32 only; integers go to tiff, hdf5, npy and raw",
                                 path.string(), text_of(o.format)));
  if (o.range && o.samples == SampleType::f32)
    throw InputError("`range` is what integers span; it goes with `samples` u16 or u8");
  if (o.range && !(o.range->first < o.range->second && std::isfinite(o.range->second - o.range->first)))
    throw InputError(
        fmt::format("`range` {},{}: the second must be above the first", o.range->first, o.range->second));
}

}  // namespace

const char* text_of(ExportFormat format) {
  for (const Name& name : format_names)
    if (name.format == format) return name.text;
  return "?";
}

std::optional<ExportFormat> export_format_of(const fs::path& path) {
  const std::string e = lower_extension(without_slash(path));
  if (e == ".mha") return ExportFormat::mha;
  if (e == ".nrrd") return ExportFormat::nrrd;
  if (e == ".npy") return ExportFormat::npy;
  if (e == ".raw") return ExportFormat::raw;
  if (e == ".tif" || e == ".tiff") return ExportFormat::tiff;
  if (e == ".h5" || e == ".hdf5") return ExportFormat::hdf5;
  if (e == ".zarr") return ExportFormat::ome_zarr;
  if (e == ".vtm") return ExportFormat::vtm;
  return std::nullopt;
}

std::vector<fs::path> export_outputs(const fs::path& path, ExportFormat format) {
  if (format == ExportFormat::npy || format == ExportFormat::raw) return {path, note_path(path)};
  if (format == ExportFormat::vtm) return {fs::path(path).replace_extension(), path};
  return {without_slash(path)};
}

std::array<int, 3> finest_per_cell(const MixedVolume& v) {
  std::array<int, 3> finest{-64, -64, -64};
  for (const LevelTriple& level : v.level)
    for (std::size_t a = 0; a < 3; ++a)
      finest[a] = std::max(finest[a], level[2 - a] - static_cast<int>(v.coarsening[2 - a]));
  return finest;
}

ExportResult export_volume(const VdvrFile& file, const fs::path& path, const ExportOptions& options,
                           const Progress& progress) {
  check_options(path, options);
  const MixedVolume& v = file.volume;
  ExportResult result;
  if (options.format == ExportFormat::vtm) {
    require_replaceable(export_outputs(path, options.format).front(), options.format);
    const VtkResult vtk =
        write_vtk(file, path, {options.most_blocks, options.compression, options.max_memory_bytes}, progress);
    return {v.grid, vtk.points, vtk.bytes, vtk.blocks, 1, 0, 0, true, vtk.jump};
  }
  const int finest = std::countr_zero(static_cast<unsigned>(options.oversampling));
  // Sizes are checked before any is multiplied: a hostile file has up to 2^24 cells along each axis.
  const Grid grid = finer(v.grid, options.oversampling);
  result.samples = io::checked_bytes(grid.samples(), sizeof(float), path.string()) / sizeof(float);
  ExportNote note = note_of(file, grid);
  const std::array<int, 3> needed = finest_per_cell(v);
  note.exact_between_samples = std::all_of(needed.begin(), needed.end(), [&](int k) { return k <= finest; });
  result.grid = grid;
  result.exact_between_samples = note.exact_between_samples;
  if (note.exact_between_samples) note.jump = result.jump = largest_jump(v, progress);
  if (options.format == ExportFormat::ome_zarr) {
    require_replaceable(without_slash(path), options.format);
    const ZarrTotals totals = write_ome_zarr(file, path, note, finest, options, progress);
    result.samples = totals.samples;
    result.bytes = totals.bytes;
    return result;
  }
  if (is_folder(path, options.format)) require_replaceable(without_slash(path), options.format);
  // TIFF shows the range, integers span it.
  if (options.format == ExportFormat::tiff || options.samples != SampleType::f32) {
    std::tie(note.lowest, note.highest) = range_of_samples(v, progress);
    note.range_is_known = true;
  }
  set_scale(note, options);
  result.scale = note.scale;
  result.offset = note.offset;
  result.bytes = write_slabs(v, path, note, options, finest, result.clipped, progress);
  return result;
}

// --- planes that come one after the other ---

struct UniformWriter::State {
  State(const fs::path& path, const ExportNote& n, const ExportOptions& options)
      : note(n), sink(sink_of(path, n, options)), encode(n), room(kept_bytes(options)) {
    const Index3 samples = n.grid.samples();
    plane = at(samples[0] * samples[1]);
    // Whole planes that the format wants together, as many as there is room for.
    const std::int64_t together = sink->planes_together();
    const auto most = static_cast<std::int64_t>(room / (plane * sizeof(float)));
    batch = at(std::max(most / together, std::int64_t{1}) * together) * plane;
  }

  void put(std::span<const float> samples) {
    sink->put(planes, encode(samples));
    planes += static_cast<std::int64_t>(samples.size() / plane);
  }

  ExportNote note;
  std::unique_ptr<VolumeSink> sink;
  Encoder encode;
  std::uint64_t room;
  std::size_t plane = 0, batch = 0;
  std::vector<float> waiting;
  std::int64_t planes = 0;  ///< put so far
};

void check_uniform_output(const fs::path& path, const ExportOptions& options) {
  if (options.format == ExportFormat::vtm)
    throw InputError(fmt::format(
        "{}: vtm holds bricks of several resolutions, which a uniform volume has none of", path.string()));
  check_options(path, options);
  if (options.oversampling != 1) throw InputError("`oversampling` is of certified volumes");
  if (options.samples != SampleType::f32 && !options.range)
    throw InputError(
        "`samples` u16 and u8 need a `range` that they span: the values are not known before they are "
        "written");
  if (is_folder(path, options.format)) require_replaceable(without_slash(path), options.format);
}

UniformWriter::UniformWriter(const fs::path& path, const Grid& grid, const ExportOptions& options) {
  check_uniform_output(path, options);
  static_cast<void>(io::checked_bytes(grid.samples(), sizeof(float), path.string()));
  ExportNote note = note_of(grid);
  set_scale(note, options);
  state_ = std::make_unique<State>(path, note, options);
}

UniformWriter::~UniformWriter() = default;

void UniformWriter::append(std::span<const float> samples) {
  State& s = *state_;
  while (!samples.empty()) {
    if (s.waiting.empty() && samples.size() >= s.batch) {
      s.put(samples.first(s.batch));
      samples = samples.subspan(s.batch);
      continue;
    }
    const std::size_t more = std::min(samples.size(), s.batch - s.waiting.size());
    s.waiting.insert(s.waiting.end(), samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(more));
    samples = samples.subspan(more);
    if (s.waiting.size() < s.batch) return;
    s.put(s.waiting);
    s.waiting.clear();
  }
}

ExportResult UniformWriter::commit() {
  State& s = *state_;
  if (s.waiting.size() % s.plane != 0) throw InputError("an exported volume ends within a plane");
  if (!s.waiting.empty()) s.put(s.waiting);
  s.waiting.clear();
  const Index3 n = s.note.grid.samples();
  if (s.planes != n[2]) throw InputError(fmt::format("{} of the {} planes of a volume came", s.planes, n[2]));
  ExportResult result;
  result.grid = s.note.grid;
  result.samples = static_cast<std::uint64_t>(n[0] * n[1] * n[2]);
  result.scale = s.note.scale;
  result.offset = s.note.offset;
  result.clipped = s.encode.clipped();
  throw_if_stopped();
  result.bytes = s.sink->commit();
  return result;
}

}  // namespace vdvr
