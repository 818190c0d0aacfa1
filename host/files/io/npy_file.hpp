// NumPy's .npy files of real numbers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace vdvr::io {

struct NpyArray {
  std::vector<std::int64_t> shape;
  std::vector<double> values;  ///< the last axis is the fastest, whatever the order in the file
};

/// Little-endian float64 or float32, in C or Fortran order, of at most 4 axes and 2^26 numbers. Throws
/// FileError: not an .npy file, another type (pickled objects are never read), a length that does not match.
NpyArray read_npy(const std::filesystem::path& path);

}  // namespace vdvr::io
