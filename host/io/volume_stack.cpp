#include "host/io/volume_stack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "host/hdf5/hdf5_reader.hpp"
#include "host/io/natural_order.hpp"
#include "host/io/tiff.hpp"
#include "host/system/limits.hpp"
#include "host/system/rehearsal.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSlabBytes = std::uint64_t{32} << 20;

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// Sizes memory for `samples` (x, y, z) on a grid of one pixel's spacing.
Volume empty_volume(const std::string& name, const std::array<std::int64_t, 3>& samples,
                    std::uint64_t max_memory_bytes) {
  Volume volume;
  for (std::size_t a = 0; a < 3; ++a) {
    // One sample bounds no cell, so there is nothing to interpolate in.
    if (samples[a] < 2)
      throw FileError(fmt::format("{}: {} samples (x, y, z), but each axis needs at least two", name,
                                  io::shape_text(samples)));
    volume.grid.cells[a] = samples[a] - 1;
  }
  const std::uint64_t bytes = io::checked_bytes(samples, sizeof(float), name);
  io::require_memory(bytes, max_memory_bytes, name);
  volume.samples.reserve(bytes / sizeof(float));
  return volume;
}

void append_samples(const std::string& name, Volume& volume, const std::vector<double>& samples) {
  for (const double s : samples) {
    const auto value = static_cast<float>(s);
    if (!std::isfinite(value))
      throw FileError(fmt::format("{}: sample {} is {}, not a finite float", name, volume.samples.size(), s));
    volume.samples.push_back(value);
  }
}

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

/// "key=value" of ImageJ's description, which has one a line.
std::string imagej_value(const std::string& description, const std::string& key) {
  std::istringstream lines(description);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.rfind(key + "=", 0) == 0) return line.substr(key.size() + 1);
  }
  return "";
}

void read_imagej_grid(const std::string& name, const io::TiffStack& stack, Grid& grid) {
  if (stack.description.rfind("ImageJ=", 0) != 0) return;
  // Beyond 4 GiB ImageJ writes one image and appends the others without a directory.
  const std::string images = imagej_value(stack.description, "images");
  if (!images.empty() && images != std::to_string(stack.images))
    throw FileError(fmt::format("{}: ImageJ wrote {} images, {} are listed; save it as a folder of slices",
                                name, images, stack.images));
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  if (positive(stack.pixels_per_unit_x)) grid.spacing[0] = 1 / stack.pixels_per_unit_x;
  if (positive(stack.pixels_per_unit_y)) grid.spacing[1] = 1 / stack.pixels_per_unit_y;
  if (const double z = std::strtod(imagej_value(stack.description, "spacing").c_str(), nullptr); positive(z))
    grid.spacing[2] = z;
  if (const std::string unit = imagej_value(stack.description, "unit"); !unit.empty()) grid.unit = unit;
}

void check_slice(const std::string& name, const Grid& grid, const io::TiffImage& image) {
  if (image.columns != grid.cells[0] + 1 || image.rows != grid.cells[1] + 1)
    throw FileError(fmt::format("{}: has {} x {} pixels, the first slice has {} x {}", name, image.columns,
                                image.rows, grid.cells[0] + 1, grid.cells[1] + 1));
}

Volume read_tiff_folder(const fs::path& folder, std::uint64_t max_memory_bytes) {
  const auto files = tiff_files(folder);
  Volume volume;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const io::TiffImage image = io::read_tiff(files[i], max_memory_bytes);
    if (i == 0)
      volume =
          empty_volume(folder.string(), {image.columns, image.rows, static_cast<std::int64_t>(files.size())},
                       max_memory_bytes);
    check_slice(files[i].string(), volume.grid, image);
    append_samples(files[i].string(), volume, image.samples);
  }
  return volume;
}

Volume read_tiff_pages(const fs::path& path, std::uint64_t max_memory_bytes) {
  Volume volume;
  io::TiffStack stack;
  io::read_tiff_stack(
      path, max_memory_bytes, [&](const io::TiffStack& s) { stack = s; },
      [&](std::int64_t index, const io::TiffImage& image) {
        if (index == 0) {
          volume = empty_volume(path.string(), {image.columns, image.rows, stack.images}, max_memory_bytes);
          read_imagej_grid(path.string(), stack, volume.grid);
        }
        check_slice(fmt::format("{}, image {}", path.string(), index), volume.grid, image);
        append_samples(path.string(), volume, image.samples);
      });
  return volume;
}

Volume read_hdf5_dataset(const fs::path& path, const std::string& dataset, std::uint64_t max_memory_bytes) {
  const io::hdf5::Reader file(path, io::hdf5::Links::within_folder);
  io::hdf5::Dataset data = file.numeric_dataset(dataset);
  data.may_be_sparse = true;
  const auto shape = data.extents();
  if (shape.size() != 3)
    throw FileError(fmt::format("{}: has {} axes; a volume has three (z, y, x)", data.name, shape.size()));
  Volume volume = empty_volume(data.name, {shape[2], shape[1], shape[0]}, max_memory_bytes);
  read_hdf5_grid(file, dataset, data.name, volume.grid);
  const std::array<std::int64_t, 2> plane{shape[1], shape[2]};
  const std::uint64_t plane_bytes = io::checked_bytes(plane, sizeof(double), data.name);
  // Slabs, so that a compressed chunk many slices deep is not inflated once a slice.
  const auto depth =
      std::clamp<std::int64_t>(static_cast<std::int64_t>(kSlabBytes / plane_bytes), 1, shape[0]);
  const std::array<std::int64_t, 3> slab_shape{depth, shape[1], shape[2]};
  const std::uint64_t bytes = io::checked_bytes(slab_shape, sizeof(double), data.name);
  io::require_memory(bytes, max_memory_bytes, data.name);
  std::vector<double> slab(bytes / sizeof(double));
  for (std::int64_t z = 0; z < shape[0]; z += depth) {
    const std::array<std::int64_t, 3> start{z, 0, 0},
        count{std::min(depth, shape[0] - z), shape[1], shape[2]};
    slab.resize(static_cast<std::size_t>(count[0] * count[1] * count[2]));
    data.read(start, count, slab.data());
    append_samples(data.name, volume, slab);
  }
  return volume;
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

Volume read_hdf5_volume(const fs::path& path, const std::string& dataset, std::uint64_t max_memory_bytes) {
  io::rehearse(path, max_memory_bytes,
               [&] { static_cast<void>(read_hdf5_dataset(path, dataset, max_memory_bytes)); });
  return read_hdf5_dataset(path, dataset, max_memory_bytes);
}

Volume read_tiff_volume(const fs::path& path, std::uint64_t max_memory_bytes) {
  return is_tiff_path(path) && !is_tiff_folder(path) ? read_tiff_pages(path, max_memory_bytes)
                                                     : read_tiff_folder(path, max_memory_bytes);
}

}  // namespace vdvr
