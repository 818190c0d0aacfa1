// Residuals as files.
#include <fmt/format.h>

#include <bit>
#include <fstream>

#include "host/files/hdf5/hdf5_writer.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/residual.hpp"
#include "vdvr/expert/volume_file.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

bool is_hdf5(const fs::path& path) { return path.extension() == ".h5" || path.extension() == ".hdf5"; }

void write_hdf5(const fs::path& path, const Residual& r) {
  const ParallelGeometry& g = r.geometry;
  io::AtomicFile file(path);
  constexpr unsigned deflate = 4;
  io::hdf5::Writer out(file.temporary(), path, {.deflate_level = deflate});
  const io::hdf5::Shape shape{static_cast<std::uint64_t>(g.views()), static_cast<std::uint64_t>(r.rows),
                              static_cast<std::uint64_t>(g.columns)};
  out.dataset<float>("lo", shape, r.lo);
  out.dataset<float>("hi", shape, r.hi);
  out.dataset<float>("reach", shape, r.reach);
  out.dataset<double>("theta_rad", {static_cast<std::uint64_t>(g.views())}, g.theta_rad);
  out.attribute("/", "format", std::string("vdvr residual"));
  out.attribute("/", "axes", std::string("view, row, column"));
  out.attribute("/", "first_row", r.first_row);
  out.attribute("/", "center", g.center);
  out.attribute("/", "pitch_u", g.pitch_u);
  out.attribute("/", "pitch_v", g.pitch_v);
  out.attribute("/", "unit", g.unit);
  out.close();
  file.commit();
}

void write_numpy(const fs::path& path, const Residual& r) {
  static_assert(std::endian::native == std::endian::little, "samples are written as they lie in memory");
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}, 3), }}",
                                   r.geometry.views(), r.rows, r.geometry.columns);
  header.append(63 - (10 + header.size()) % 64, ' ').push_back('\n');
  io::AtomicFile file(path);
  std::ofstream out(file.temporary(), std::ios::binary);
  out.write("\x93NUMPY\x01\x00", 8);
  out.put(static_cast<char>(header.size() & 0xff)).put(static_cast<char>(header.size() >> 8));
  out << header;
  for (std::size_t i = 0; i < r.lo.size(); ++i) {
    const std::array<float, 3> ray{r.lo[i], r.hi[i], r.reach[i]};
    out.write(reinterpret_cast<const char*>(ray.data()), sizeof ray);
  }
  out.close();
  if (!out) throw ResourceError(fmt::format("{}: could not be written; is the disk full?", path.string()));
  file.commit();
}

void write_middles(const fs::path& path, const Residual& r) {
  Grid grid;
  grid.unit = r.geometry.unit;
  grid.cells = {r.geometry.columns - 1, r.rows - 1, r.geometry.views() - 1};
  grid.spacing = {r.geometry.pitch_u, r.geometry.pitch_v, 1};
  VolumeWriter writer(path, grid);
  std::vector<float> middles;
  middles.reserve(r.lo.size());
  for (std::size_t i = 0; i < r.lo.size(); ++i) middles.push_back(static_cast<float>(r.middle(i)));
  writer.append(middles);
  writer.commit();
}

}  // namespace

bool is_residual_path(const fs::path& path) {
  return is_hdf5(path) || path.extension() == ".npy" || is_volume_path(path);
}

void write_residual(const fs::path& path, const Residual& residual) {
  if (is_hdf5(path)) write_hdf5(path, residual);
  else if (path.extension() == ".npy") write_numpy(path, residual);
  else if (is_volume_path(path)) write_middles(path, residual);
  else throw InputError(fmt::format("{}: end the name in .h5, .npy, .mha or .nrrd", path.string()));
}

}  // namespace vdvr
