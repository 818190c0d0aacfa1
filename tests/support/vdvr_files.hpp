// Small .vdvr files and their damage: volumes compared by bits, and edits by raw HDF5 calls, independent of
// host/files/io. Used by the tests of the .vdvr file.
#pragma once

#include <hdf5.h>
#include <unistd.h>
#include <boost/test/unit_test.hpp>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/support/certificates.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::support {

namespace fs = std::filesystem;

struct Folder {
  Folder() {
    std::string name = (fs::temp_directory_path() / "vdvr_file_test.XXXXXX").string();
    BOOST_REQUIRE(::mkdtemp(name.data()) != nullptr);
    path = name;
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Folder() { fs::remove_all(path); }
  fs::path path;
};

inline const std::vector<LevelTriple> triples{{0, 0, 0}, {1, 1, 1}, {0, 2, 1}, {2, 2, 2}};

inline MixedVolume small_volume() {
  const Grid grid{{9, 5, 7}, {-4.5, 0.1, 1e-7}, {1, 0.5, 0.7071067811865476}, "mm"};
  return support::random_mixed(grid, 4, 8, triples, 12);
}

inline fs::path write_small(const Folder& folder, const char* name = "small.vdvr") {
  write_vdvr(folder.path / name, small_volume(), support::full_certificate());
  return folder.path / name;
}

inline void put(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// Compares bits, so that -0 and 0 differ.
template <class Array>
bool same_bits(const Array& a, const Array& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(*a.data())) == 0);
}

inline bool same_block(const SampleBlock& a, const SampleBlock& b) {
  return a.type == b.type && same_bits(a.f32, b.f32) && same_bits(a.u16, b.u16) && same_bits(a.u8, b.u8) &&
         same_bits(a.offset, b.offset) && same_bits(a.shift, b.shift);
}

inline bool same_volume(const MixedVolume& a, const MixedVolume& b) {
  bool same = a.grid.cells == b.grid.cells && a.grid.origin == b.grid.origin &&
              a.grid.spacing == b.grid.spacing && a.grid.unit == b.grid.unit &&
              a.granularity == b.granularity && a.rate == b.rate && a.step == b.step &&
              same_block(a.base, b.base) && same_bits(a.level, b.level) && same_bits(a.tile, b.tile) &&
              a.tiles.size() == b.tiles.size();
  for (const auto& [triple, samples] : a.tiles)
    same = same && b.tiles.contains(triple) && same_block(samples, b.tiles.at(triple));
  return same;
}

/// The message of the FileError that reading gives; "accepted" when it gives none, altered or not.
inline std::string refusal(const fs::path& path) {
  try {
    read_vdvr(path, 0, Altered::report);
  } catch (const FileError& e) {
    return e.what();
  }
  return "accepted";
}

inline bool says(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts)
    if (message.find(part) == std::string::npos) {
      BOOST_TEST_MESSAGE("message lacks '" << part << "': " << message);
      return false;
    }
  return true;
}

using Edit = std::function<void(hid_t file)>;

/// A small file, changed by raw HDF5 calls: what a damaged or crafted file looks like to the reader.
inline std::string refusal_after(const Edit& edit) {
  const Folder folder;
  const fs::path path = write_small(folder);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  BOOST_REQUIRE(file >= 0);
  edit(file);
  BOOST_REQUIRE(H5Fclose(file) >= 0);
  return refusal(path);
}

enum class Protection { fletcher32, none, deflate, checksum_first };

template <class T>
Edit replace(const char* path, hid_t type, hid_t memory, std::vector<hsize_t> shape, std::vector<T> values,
             Protection protection = Protection::fletcher32) {
  return [=](hid_t file) {
    H5Ldelete(file, path, H5P_DEFAULT);
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    std::vector<hsize_t> chunk = shape;
    for (hsize_t& n : chunk) n = std::max<hsize_t>(1, std::min<hsize_t>(n, 8));
    H5Pset_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
    if (protection == Protection::checksum_first) H5Pset_fletcher32(properties);
    if (protection == Protection::deflate || protection == Protection::checksum_first)
      H5Pset_deflate(properties, 1);
    if (protection == Protection::fletcher32 || protection == Protection::deflate)
      H5Pset_fletcher32(properties);
    const hid_t dataset = H5Dcreate2(file, path, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
    BOOST_REQUIRE(dataset >= 0);
    if (!values.empty())
      BOOST_REQUIRE(H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
    H5Dclose(dataset);
    H5Pclose(properties);
    H5Sclose(space);
  };
}

template <class T>
Edit overwrite(const char* path, hid_t memory, std::vector<T> values) {
  return [=](hid_t file) {
    const hid_t dataset = H5Dopen2(file, path, H5P_DEFAULT);
    BOOST_REQUIRE(H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
    H5Dclose(dataset);
  };
}

template <class T>
Edit set_attribute(const char* object, const char* name, hid_t type, std::vector<T> values) {
  return [=](hid_t file) {
    H5Adelete_by_name(file, object, name, H5P_DEFAULT);
    const hsize_t count = values.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t attribute =
        H5Acreate_by_name(file, object, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    BOOST_REQUIRE(H5Awrite(attribute, type, values.data()) >= 0);
    H5Aclose(attribute);
    H5Sclose(space);
  };
}

inline Edit set_cells(std::int64_t z, std::int64_t y, std::int64_t x) {
  return set_attribute<std::int64_t>("/grid", "cells", H5T_NATIVE_INT64, {z, y, x});
}
inline Edit set_spacing(double z, double y, double x) {
  return set_attribute<double>("/grid", "spacing", H5T_NATIVE_DOUBLE, {z, y, x});
}
inline Edit set_integer(const char* object, const char* name, std::int64_t value) {
  return set_attribute<std::int64_t>(object, name, H5T_NATIVE_INT64, {value});
}
inline Edit set_certificate(const std::string& text) {
  return [=](hid_t file) {
    H5Ldelete(file, "/certificate", H5P_DEFAULT);
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, H5T_VARIABLE);
    const hid_t dataset =
        H5Dcreate2(file, "/certificate", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const char* first = text.c_str();
    BOOST_REQUIRE(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &first) >= 0);
    H5Dclose(dataset);
    H5Tclose(type);
    H5Sclose(space);
  };
}

inline std::vector<std::uint8_t> levels_of(const MixedVolume& v) {
  std::vector<std::uint8_t> levels;
  for (const LevelTriple& l : v.level) levels.insert(levels.end(), l.begin(), l.end());
  return levels;
}

inline std::size_t brick_with(const MixedVolume& v, const LevelTriple& l, std::uint32_t tile) {
  for (std::size_t i = 0; i < v.level.size(); ++i)
    if (v.level[i] == l && v.tile[i] == tile) return i;
  BOOST_FAIL("the test volume lacks this triple");
  return 0;
}

}  // namespace vdvr::support
