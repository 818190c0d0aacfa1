// Valid HDF5 files for the fuzz programs, in the layouts that other programs write: old metadata without
// checksums, contiguous, chunked, compressed, text of variable length.
#pragma once

#include <hdf5.h>

#include <functional>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace vdvr::fuzz {

/// Bytes of a file made by `write`.
inline std::string bytes_of_new(const std::filesystem::path& path,
                                const std::function<void(const std::filesystem::path&)>& write) {
  write(path);
  std::string bytes = support::bytes_of(path);
  std::filesystem::remove(path);
  return bytes;
}

/// The same objects in another layout of HDF5: `latest` with checksums on the metadata, else without.
inline std::string in_layout(const std::filesystem::path& from, bool latest) {
  return bytes_of_new(from.string() + ".copy", [&](const std::filesystem::path& to) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_libver_bounds(access, latest ? H5F_LIBVER_V110 : H5F_LIBVER_EARLIEST, H5F_LIBVER_V110);
    const hid_t source = H5Fopen(from.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    const hid_t target = H5Fcreate(to.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
    // Attributes of the root are not copied with its members.
    const hid_t root = H5Oopen(source, "/", H5P_DEFAULT), new_root = H5Oopen(target, "/", H5P_DEFAULT);
    H5Literate(
        root, H5_INDEX_NAME, H5_ITER_INC, nullptr,
        [](hid_t group, const char* name, const H5L_info_t*, void* to_root) -> herr_t {
          return H5Ocopy(group, name, *static_cast<const hid_t*>(to_root), name, H5P_DEFAULT, H5P_DEFAULT);
        },
        const_cast<hid_t*>(&new_root));
    H5Aiterate2(
        root, H5_INDEX_NAME, H5_ITER_INC, nullptr,
        [](hid_t object, const char* name, const H5A_info_t*, void* to_root) -> herr_t {
          const hid_t a = H5Aopen(object, name, H5P_DEFAULT), type = H5Aget_type(a), space = H5Aget_space(a);
          std::string value(H5Tget_size(type), '\0');
          H5Aread(a, type, value.data());
          const hid_t b =
              H5Acreate2(*static_cast<const hid_t*>(to_root), name, type, space, H5P_DEFAULT, H5P_DEFAULT);
          H5Awrite(b, type, value.data());
          H5Aclose(b);
          H5Sclose(space);
          H5Tclose(type);
          H5Aclose(a);
          return 0;
        },
        const_cast<hid_t*>(&new_root));
    H5Oclose(root);
    H5Oclose(new_root);
    H5Fclose(source);
    H5Fclose(target);
    H5Pclose(access);
  });
}

/// A dataset in chunks of one plane, with shuffle and Deflate; `all_filters`: checksum, packed integers too.
inline void write_compressed(hid_t file, const char* name, const std::vector<hsize_t>& shape,
                             const std::vector<double>& values, bool all_filters = false) {
  const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
  std::vector<hsize_t> chunk = shape;
  chunk[0] = 1;
  H5Pset_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
  if (all_filters) H5Pset_scaleoffset(properties, H5Z_SO_INT, H5Z_SO_INT_MINBITS_DEFAULT);
  H5Pset_shuffle(properties);
  H5Pset_deflate(properties, 4);
  if (all_filters) H5Pset_fletcher32(properties);
  const hid_t data = H5Dcreate2(file, name, H5T_STD_U16LE, space, H5P_DEFAULT, properties, H5P_DEFAULT);
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Dclose(data);
  H5Pclose(properties);
  H5Sclose(space);
}

}  // namespace vdvr::fuzz
