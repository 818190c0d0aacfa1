// The samples of a uniform volume as a reader finds them, x fastest: sized before they come, and held to be
// finite numbers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "vdvr/expert/grid.hpp"

namespace vdvr::io {

class VolumeSamples {
 public:
  /// Takes memory for `samples` (x, y, z) on a grid of one pixel's spacing, `nan_as` for what is no finite
  /// float. `name` is that of the file. Throws FileError where an axis has fewer than two samples,
  /// ResourceError.
  VolumeSamples(std::string name, const std::array<std::int64_t, 3>& samples, std::uint64_t max_memory_bytes,
                std::optional<double> nan_as);
  [[nodiscard]] Grid& grid() { return volume_.grid; }
  void append(std::span<const double> samples);
  /// Throws FileError where samples were no finite floats, with the first and how many, and nothing to read
  /// them as.
  [[nodiscard]] Volume take();

 private:
  std::string name_;
  std::optional<double> nan_as_;
  Volume volume_;
  std::size_t bad_ = 0, first_bad_ = 0;
  double bad_value_ = 0;
};

}  // namespace vdvr::io
