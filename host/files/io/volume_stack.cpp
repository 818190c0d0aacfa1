#include "host/files/io/volume_stack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/system/limits.hpp"
#include "host/base/system/lower.hpp"
#include "host/base/system/read_in_child.hpp"
#include "host/files/hdf5/hdf5_reader.hpp"
#include "host/files/io/natural_order.hpp"
#include "host/files/io/number_text.hpp"
#include "host/files/io/tiff.hpp"
#include "host/files/io/volume_samples.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSlabBytes = std::uint64_t{32} << 20;

// --- HDF5 ---

/// An attribute z, y, x turned to x, y, z.
std::optional<Vec3> zyx_attribute(const io::hdf5::Reader& file, const std::string& dataset,
                                  const std::string& name) {
  const auto values = file.find_reals(dataset, name, 3);
  if (!values) return std::nullopt;
  return Vec3{(*values)[2], (*values)[1], (*values)[0]};
}

void read_hdf5_grid(const io::hdf5::Reader& file, const std::string& dataset, const std::string& name,
                    Grid& grid) {
  if (const auto origin = zyx_attribute(file, dataset, "origin")) grid.origin = *origin;
  if (const auto spacing = zyx_attribute(file, dataset, "spacing")) {
    grid.spacing = *spacing;
  } else if (const auto micrometres = zyx_attribute(file, dataset, "element_size_um")) {
    grid.spacing = *micrometres;  // as ImageJ's and ilastik's HDF5 files have it
    grid.unit = "um";
  }
  if (const auto unit = file.find_text(dataset, "unit")) grid.unit = *unit;
  for (std::size_t a = 0; a < 3; ++a)
    if (!(grid.spacing[a] > 0) || !std::isfinite(grid.spacing[a]) || !std::isfinite(grid.origin[a]))
      throw FileError(fmt::format("{}: spacing {} and origin {} along {}; one must be positive, both finite",
                                  name, grid.spacing[a], grid.origin[a], "xyz"[a]));
}

// --- TIFF ---

std::vector<fs::path> tiff_files(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (is_tiff_path(it->path()) && it->is_regular_file(error))
      names.push_back(it->path().filename().string());
  std::sort(names.begin(), names.end(), io::natural_less);
  std::vector<fs::path> files;
  for (const auto& name : names) files.push_back(folder / name);
  return files;
}

/// A number of ImageJ's description; nothing where there is none.
std::optional<double> imagej_number(const io::TiffStack& stack, const std::string& key) {
  return io::number_of(io::imagej_value(stack.description, key));
}

void read_imagej_grid(const io::TiffStack& stack, Grid& grid) {
  if (stack.description.rfind("ImageJ=", 0) != 0) return;
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  if (positive(stack.pixels_per_unit_x)) grid.spacing[0] = 1 / stack.pixels_per_unit_x;
  if (positive(stack.pixels_per_unit_y)) grid.spacing[1] = 1 / stack.pixels_per_unit_y;
  if (const auto z = imagej_number(stack, "spacing"); z && *z > 0) grid.spacing[2] = *z;
  // ImageJ's origin is the pixel that lies at zero.
  constexpr std::array<const char*, 3> origins{"xorigin", "yorigin", "zorigin"};
  for (std::size_t a = 0; a < 3; ++a)
    if (const auto pixel = imagej_number(stack, origins[a]); pixel && *pixel != 0)
      grid.origin[a] = -*pixel * grid.spacing[a];
  if (const std::string unit = io::imagej_value(stack.description, "unit"); !unit.empty()) grid.unit = unit;
}

Volume read_slices(const fs::path& path, std::vector<fs::path> files, const VolumeLimits& limits) {
  io::TiffSeries series(std::move(files), limits.max_memory_bytes);
  const io::TiffStack& s = series.stack();
  io::VolumeSamples volume(path.string(), {s.columns, s.rows, s.images}, limits.max_memory_bytes,
                           limits.nan_as);
  read_imagej_grid(s, volume.grid());
  std::vector<double> slice(static_cast<std::size_t>(s.rows * s.columns));
  for (std::int64_t z = 0; z < s.images; ++z) {
    series.read(z, slice.data());
    volume.append(slice);
  }
  return volume.take();
}

/// What integers stand for, where they are an export's: value = offset + scale * integer.
std::pair<double, double> read_hdf5_scale(const io::hdf5::Reader& file, const std::string& dataset,
                                          const std::string& name) {
  const auto scale = file.find_reals(dataset, "scale", 1), offset = file.find_reals(dataset, "offset", 1);
  if (!scale || !offset) return {1, 0};
  if (!std::isfinite(scale->front()) || !std::isfinite(offset->front()) || scale->front() == 0)
    throw FileError(fmt::format("{}: scale {} and offset {}; both must be finite, the scale not 0", name,
                                scale->front(), offset->front()));
  return {scale->front(), offset->front()};
}

Volume read_hdf5_dataset(const fs::path& path, const std::string& dataset, const VolumeLimits& limits) {
  const io::hdf5::Reader file(path, io::hdf5::Links::within_folder);
  io::hdf5::Dataset data = file.numeric_dataset(dataset);
  data.may_be_sparse = true;
  const auto shape = data.extents();
  if (shape.size() != 3)
    throw FileError(fmt::format("{}: has {} axes; a volume has three (z, y, x)", data.name, shape.size()));
  io::VolumeSamples volume(data.name, {shape[2], shape[1], shape[0]}, limits.max_memory_bytes, limits.nan_as);
  read_hdf5_grid(file, dataset, data.name, volume.grid());
  const auto [scale, offset] = read_hdf5_scale(file, dataset, data.name);
  const std::array<std::int64_t, 2> plane{shape[1], shape[2]};
  const std::uint64_t plane_bytes = io::checked_bytes(plane, sizeof(double), data.name);
  // Slabs, so that a compressed chunk many slices deep is not inflated once a slice.
  const auto depth =
      std::clamp<std::int64_t>(static_cast<std::int64_t>(kSlabBytes / plane_bytes), 1, shape[0]);
  const std::array<std::int64_t, 3> slab_shape{depth, shape[1], shape[2]};
  const std::uint64_t bytes = io::checked_bytes(slab_shape, sizeof(double), data.name);
  io::require_memory(bytes, limits.max_memory_bytes, data.name);
  std::vector<double> slab(bytes / sizeof(double));
  for (std::int64_t z = 0; z < shape[0]; z += depth) {
    const std::array<std::int64_t, 3> start{z, 0, 0},
        count{std::min(depth, shape[0] - z), shape[1], shape[2]};
    slab.resize(static_cast<std::size_t>(count[0] * count[1] * count[2]));
    data.read(start, count, slab.data());
    if (scale != 1 || offset != 0)
      for (double& value : slab) value = offset + scale * value;
    volume.append(slab);
  }
  return volume.take();
}

}  // namespace

std::optional<std::pair<fs::path, std::string>> hdf5_volume_path(const fs::path& path) {
  const std::string text = path.string();
  for (const char* extension : {".h5:", ".hdf5:", ".hdf:", ".nxs:", ".nx:"}) {
    const std::string mark(extension);
    const auto at = text.find(mark);
    if (at == std::string::npos || at == 0 || at + mark.size() == text.size()) continue;
    std::string dataset = text.substr(at + mark.size());
    if (dataset.front() != '/') dataset.insert(0, "/");
    return std::pair{fs::path(text.substr(0, at + mark.size() - 1)), dataset};
  }
  return std::nullopt;
}

bool is_tiff_path(const fs::path& path) {
  const std::string e = lower_extension(path);
  return e == ".tif" || e == ".tiff";
}

bool is_tiff_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error) && !fs::exists(path / "scan.json", error) && !tiff_files(path).empty();
}

Volume read_hdf5_volume(const fs::path& path, const std::string& dataset, const VolumeLimits& limits) {
  io::read_in_child(path, limits.max_memory_bytes,
                    [&] { static_cast<void>(read_hdf5_dataset(path, dataset, limits)); });
  return read_hdf5_dataset(path, dataset, limits);
}

Volume read_tiff_volume(const fs::path& path, const VolumeLimits& limits) {
  const bool is_folder = is_tiff_folder(path);
  return read_slices(path, is_folder ? tiff_files(path) : std::vector{path}, limits);
}

}  // namespace vdvr
