// Names, shapes and versions of the .vdvr file (docs/file-format.md). Datasets are [z][y][x] and triples
// "ZYX", as MixedVolume holds them; grid attributes are turned from x,y,z to z,y,x.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>

#include "host/files/hdf5/hdf5_reader.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

// Version 2 is version 1 with integer samples, version 3 with triples whose tiles have several types, version
// 4 with a base coarser than the grid; a file has the lowest that says what it holds.
inline constexpr int newest_version = 4;

inline constexpr const char* kTotals = "/brick_total";
inline constexpr const char* kSigma = "/brick_sigma";
inline constexpr const char* kCertificate = "/certificate";
/// In its place where nothing is certified, so that nobody takes the one for the other.
inline constexpr const char* kComparison = "/comparison";

template <class T>
std::array<T, 3> zyx(const std::array<T, 3>& xyz) {
  return {xyz[2], xyz[1], xyz[0]};
}

inline io::hdf5::Shape shape_of(std::initializer_list<std::int64_t> extents) {
  io::hdf5::Shape shape;
  for (const std::int64_t n : extents) shape.push_back(static_cast<std::uint64_t>(n));
  return shape;
}

inline io::hdf5::Shape base_shape(const MixedVolume& v) {
  const Index3 s = v.base_samples();
  return shape_of({s[2], s[1], s[0]});
}

inline bool is_coarse(const MixedVolume& v) { return v.coarsening != LevelTriple{0, 0, 0}; }

/// As the file and its hash have it, z, y, x.
inline std::array<std::int64_t, 3> wide(const LevelTriple& zyx) { return {zyx[0], zyx[1], zyx[2]}; }

}  // namespace vdvr
