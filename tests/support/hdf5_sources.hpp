// HDF5 files whose numbers lie in others, and compressed ones, written with the plain C API. Used by the
// tests and the fuzz programs of the HDF5 readers.
#pragma once

#include <utility>

#include "host/files/hdf5/zstd_filter.hpp"
#include "tests/support/scan_files.hpp"

namespace vdvr::support {

/// A source's file and dataset, and how many frames of it.
struct Part {
  std::string file, dataset;
  hsize_t frames;
};

/// A virtual dataset of frames, part after part along its first axis. `first`: where the first part begins.
inline void write_virtual(hid_t file, const std::string& name, const Shape& shape,
                          const std::vector<Part>& parts, hid_t type = H5T_IEEE_F32LE, hsize_t first = 0) {
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  for (const Part& part : parts) {
    Shape start(shape.size(), 0), count = shape;
    start[0] = first;
    count[0] = part.frames;
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    const hid_t source = H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr);
    H5Pset_virtual(creation, space, part.file.c_str(), part.dataset.c_str(), source);
    H5Sclose(source);
    first += part.frames;
  }
  H5Sselect_all(space);
  H5Dclose(H5Dcreate2(file, name.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT));
  H5Sclose(space);
  H5Pclose(creation);
}

/// A dataset in chunks of one frame, through one filter; false where that is not installed.
inline bool write_filtered(hid_t file, const std::string& name, const Shape& shape,
                           const std::vector<double>& values, H5Z_filter_t filter,
                           const std::vector<unsigned>& parameters = {}, hid_t type = H5T_IEEE_F32LE) {
  io::hdf5::register_zstd_filter();
  if (H5Zfilter_avail(filter) <= 0) return false;
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  Shape chunk = shape;
  chunk[0] = 1;
  H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
  H5Pset_filter(creation, filter, H5Z_FLAG_MANDATORY, parameters.size(), parameters.data());
  const hid_t set = H5Dcreate2(file, name.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  const bool written = H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0 &&
                       H5Fflush(file, H5F_SCOPE_LOCAL) >= 0;
  H5Dclose(set);
  H5Sclose(space);
  H5Pclose(creation);
  return written;
}

inline void link_external(hid_t file, const std::string& name, const std::string& to,
                          const std::string& path) {
  H5Lcreate_external(to.c_str(), path.c_str(), file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
}

/// Flats, darks and angles of a Data Exchange file, without its projections.
inline void write_exchange_rest(Hdf5Writer& file) {
  file.group("/exchange");
  file.dataset("/exchange/theta", {K}, {0, 45, 90, 135}, H5T_IEEE_F64LE);
  file.dataset("/exchange/data_white", {2, V, U}, std::vector<double>(2 * V * U, 10100));
  file.dataset("/exchange/data_dark", {1, V, U}, std::vector<double>(V * U, 100));
}

/// The projections k .. k + n - 1 in a file of their own, as /entry/data.
inline void write_part(const Path& path, int k, int n) {
  Hdf5Writer file(path);
  file.group("/entry");
  const std::vector<double> all = raw_counts();
  file.dataset("/entry/data", {static_cast<hsize_t>(n), V, U},
               {all.begin() + k * V * U, all.begin() + (k + n) * V * U});
}

/// A Data Exchange scan in three files: two parts of projections, and a virtual dataset over them.
inline Path write_virtual_exchange(const Path& path, const std::string& first = "part0.h5",
                                   const std::string& second = "part1.h5") {
  write_part(path.parent_path() / first, 0, 1);
  write_part(path.parent_path() / second, 1, K - 1);
  Hdf5Writer file(path);
  write_exchange_rest(file);
  write_virtual(file.id(), "/exchange/data", {K, V, U},
                {{first, "/entry/data", 1}, {second, "/entry/data", K - 1}});
  return path;
}

}  // namespace vdvr::support
