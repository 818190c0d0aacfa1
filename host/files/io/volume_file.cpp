// Uniform volumes as MetaImage or NRRD: any scalar type in, float32 out; volume_stack.cpp reads the rest.
// Layout float samples[z][y][x], x fastest.
#include "vdvr/expert/volume_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <vector>

#include "host/base/system/limits.hpp"
#include "host/base/system/lower.hpp"
#include "host/files/io/npy_file.hpp"
#include "host/files/io/raster_file.hpp"
#include "host/files/io/volume_samples.hpp"
#include "host/files/io/volume_stack.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {
namespace {

std::string mha_header(const Grid& grid) {
  const Index3 n = grid.samples();
  const bool known = grid.unit == "mm" || grid.unit == "um" || grid.unit == "cm";
  const std::string unit = known ? "DistanceUnits = " + grid.unit : "Comment = unit: " + grid.unit;
  return fmt::format(
      "ObjectType = Image\nNDims = 3\n{}\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData "
      "= False\n"
      "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = {} {} {}\nElementSpacing = {} {} {}\nDimSize = {} {} "
      "{}\n"
      "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n",
      unit, grid.origin[0], grid.origin[1], grid.origin[2], grid.spacing[0], grid.spacing[1], grid.spacing[2],
      n[0], n[1], n[2]);
}

std::string nrrd_header(const Grid& grid) {
  const Index3 n = grid.samples();
  return fmt::format(
      "NRRD0004\ntype: float\ndimension: 3\nspace dimension: 3\nsizes: {} {} {}\n"
      "space directions: ({},0,0) (0,{},0) (0,0,{})\nkinds: domain domain domain\nspace units: \"{}\" \"{}\" "
      "\"{}\"\n"
      "endian: little\nencoding: raw\nspace origin: ({},{},{})\n\n",
      n[0], n[1], n[2], grid.spacing[0], grid.spacing[1], grid.spacing[2], grid.unit, grid.unit, grid.unit,
      grid.origin[0], grid.origin[1], grid.origin[2]);
}

void append_little_endian(std::ofstream& file, std::span<const float> samples) {
  if constexpr (std::endian::native == std::endian::little) {
    file.write(reinterpret_cast<const char*>(samples.data()),
               static_cast<std::streamsize>(samples.size() * sizeof(float)));
  } else {
    for (const float sample : samples) {
      const auto bits = std::bit_cast<std::uint32_t>(sample);
      for (int b = 0; b < 4; ++b) file.put(static_cast<char>(bits >> (8 * b)));
    }
  }
}

/// The volume whose axes are those of the world, of one whose axes run as `axes` says; every sample stays
/// where it is.
Volume along_axes(const Volume& from, const io::RasterAxes& axes) {
  Volume to;
  to.grid = from.grid;
  std::array<std::int64_t, 3> stride{};  // in `to`, by axis of `from`
  std::int64_t start = 0;
  for (std::size_t f = 0; f < 3; ++f) {
    const std::size_t a = axes.along[f];
    to.grid.cells[a] = from.grid.cells[f];
    to.grid.spacing[a] = from.grid.spacing[f];
  }
  const Index3 n = to.grid.samples(), plain{1, n[0], n[0] * n[1]};
  for (std::size_t f = 0; f < 3; ++f) {
    const std::size_t a = axes.along[f];
    stride[f] = axes.reversed[f] ? -plain[a] : plain[a];
    if (!axes.reversed[f]) continue;
    start += (n[a] - 1) * plain[a];
    to.grid.origin[a] -= static_cast<double>(n[a] - 1) * to.grid.spacing[a];
  }
  to.samples.resize(from.samples.size());
  const Index3 m = from.grid.samples();
  std::size_t i = 0;
  for (std::int64_t z = 0; z < m[2]; ++z)
    for (std::int64_t y = 0; y < m[1]; ++y)
      for (std::int64_t x = 0; x < m[0]; ++x)
        to.samples[static_cast<std::size_t>(start + x * stride[0] + y * stride[1] + z * stride[2])] =
            from.samples[i++];
  return to;
}

}  // namespace

bool is_volume_input(const std::filesystem::path& path) {
  return is_volume_path(path) || is_tiff_path(path) || hdf5_volume_path(path) || is_tiff_folder(path);
}

namespace {

Volume read_npy_volume(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                       std::optional<double> nan_as) {
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(path, unknown);
  // As doubles, beside the samples.
  if (!unknown) io::require_memory(3 * bytes, max_memory_bytes, path.string());
  const io::NpyArray array = io::read_npy(path);
  if (array.shape.size() != 3)
    throw FileError(fmt::format("{}: a volume has three axes, z, y and x; this array has {}", path.string(),
                                array.shape.size()));
  io::VolumeSamples samples(path.string(), {array.shape[2], array.shape[1], array.shape[0]}, max_memory_bytes,
                            nan_as);
  samples.append(array.values);
  return samples.take();
}

}  // namespace

std::filesystem::path file_of_volume(const std::filesystem::path& path) {
  const auto parts = hdf5_volume_path(path);
  return parts ? parts->first : path;
}

bool is_volume_path(const std::filesystem::path& path) {
  const std::string e = lower_extension(path);
  return e == ".mha" || e == ".mhd" || e == ".nrrd" || e == ".nhdr";
}

Volume read_volume(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                   std::optional<double> nan_as) {
  const VolumeLimits limits{max_memory_bytes, nan_as};
  if (const auto parts = hdf5_volume_path(path)) return read_hdf5_volume(parts->first, parts->second, limits);
  if (is_tiff_path(path) || is_tiff_folder(path)) return read_tiff_volume(path, limits);
  if (lower_extension(path) == ".npy") return read_npy_volume(path, max_memory_bytes, nan_as);
  if (!is_volume_path(path))
    throw FileError(fmt::format(
        "{}: not a volume by its name (.mha, .mhd, .nrrd, .nhdr, .tif, .npy, FILE.h5:/dataset, a folder "
        "of TIFF slices)",
        path.string()));
  io::RasterSamples source(io::read_raster_header(path), max_memory_bytes);
  const io::RasterHeader& header = source.header();
  io::VolumeSamples samples(path.string(), header.samples, max_memory_bytes, nan_as);
  const std::int64_t count = samples.grid().sample_count();
  std::vector<double> block(static_cast<std::size_t>(std::min<std::int64_t>(1 << 20, count)));
  for (std::int64_t first = 0; first < count; first += static_cast<std::int64_t>(block.size())) {
    block.resize(static_cast<std::size_t>(
        std::min<std::int64_t>(static_cast<std::int64_t>(block.size()), count - first)));
    source.read(first, static_cast<std::int64_t>(block.size()), block.data());
    samples.append(block);
  }
  Volume volume = samples.take();
  volume.grid.spacing = header.spacing;
  volume.grid.origin = header.origin;
  if (!header.unit.empty()) volume.grid.unit = header.unit;
  if (!header.axes.are_plain()) {
    // The samples once more, in their new order.
    io::require_memory(2 * volume.samples.size() * sizeof(float), max_memory_bytes, path.string());
    volume = along_axes(volume, header.axes);
  }
  return volume;
}

struct VolumeWriter::File {
  File(const std::filesystem::path& to, const Grid& of)
      : path(to), grid(of), target(to), stream(target.temporary(), std::ios::binary | std::ios::trunc) {}
  std::filesystem::path path;
  Grid grid;
  io::AtomicFile target;
  std::ofstream stream;
  std::int64_t samples = 0;
};

VolumeWriter::VolumeWriter(const std::filesystem::path& path, const Grid& grid) {
  const std::string extension = lower_extension(path);
  if (extension != ".mha" && extension != ".nrrd")
    throw InputError(fmt::format("{}: volumes are written as .mha or .nrrd", path.string()));
  if (grid.unit.find_first_of("\n\r\"") != std::string::npos)
    throw InputError(fmt::format("{}: a unit may not hold quotes or line ends", path.string()));
  file_ = std::make_unique<File>(path, grid);
  const std::uint64_t bytes = io::checked_bytes(grid.samples(), sizeof(float), path.string());
  std::error_code unknown;
  const std::filesystem::space_info disk = std::filesystem::space(file_->target.temporary(), unknown);
  if (!unknown && disk.available < bytes)
    throw ResourceError(fmt::format(
        "{}: takes {:.1f} MiB, but only {:.1f} MiB of its disk are free; write it to another, or choose a "
        "smaller `size`",
        path.string(), static_cast<double>(bytes) / 0x1p20, static_cast<double>(disk.available) / 0x1p20));
  file_->stream << (extension == ".mha" ? mha_header(grid) : nrrd_header(grid));
}

VolumeWriter::~VolumeWriter() = default;

void VolumeWriter::append(std::span<const float> samples) {
  append_little_endian(file_->stream, samples);
  file_->samples += static_cast<std::int64_t>(samples.size());
}

void VolumeWriter::commit() {
  const std::string path = file_->path.string();
  if (file_->samples != file_->grid.sample_count())
    throw InputError(fmt::format("{}: {} samples for a grid of {}", path, file_->samples,
                                 io::shape_text(file_->grid.samples())));
  file_->stream.close();
  if (!file_->stream) throw ResourceError(fmt::format("{}: cannot be written; is the disk full?", path));
  file_->target.commit();
}

void write_volume(const std::filesystem::path& path, const Volume& volume) {
  VolumeWriter file(path, volume.grid);
  file.append(volume.samples);
  file.commit();
}

}  // namespace vdvr
