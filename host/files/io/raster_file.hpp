// MetaImage (.mha, .mhd) and NRRD (.nrrd, .nhdr): headers, and samples of any scalar type as double, raw or
// gzip, in either byte order. The file's first axis is the fastest.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "host/files/io/raster_axes.hpp"
#include "host/files/io/stored_numbers.hpp"

namespace vdvr::io {

struct RasterHeader {
  std::filesystem::path file;                    ///< the header
  std::filesystem::path data_file;               ///< the same file where the header is attached
  std::string format;                            ///< "mha" or "nrrd"
  std::uint64_t data_offset = 0;                 ///< bytes before the samples in data_file
  bool data_at_end = false;                      ///< the samples are the file's last bytes instead
  std::array<std::int64_t, 3> samples{0, 0, 0};  ///< by axis of the file
  std::array<double, 3> spacing{1, 1, 1};        ///< by axis of the file
  std::array<double, 3> origin{0, 0, 0};         ///< of its first sample, in the world
  RasterAxes axes;
  std::string unit;  ///< empty when the file does not say
  ScalarKind kind = ScalarKind::floating;
  int sample_bytes = 4;
  bool big_endian = false;
  bool gzip = false;
};

/// True when the file begins like MetaImage or NRRD. False also when it cannot be read.
bool is_raster_file(const std::filesystem::path& path);

/// Throws FileError naming the field: not three-dimensional, vectors, axes oblique to the world's, unknown
/// types or encodings, samples outside the header's file beyond its folder. Axes that are oblique by so
/// little that no sample is off by more than a thousandth of the spacing count as straight: files hold
/// rounded directions.
RasterHeader read_raster_header(const std::filesystem::path& path);

/// The samples behind a header. Opening checks that the file is long enough; gzip data are inflated at once.
class RasterSamples {
 public:
  explicit RasterSamples(RasterHeader header, std::uint64_t max_memory_bytes = 0);
  ~RasterSamples();
  RasterSamples(RasterSamples&&) noexcept;
  [[nodiscard]] const RasterHeader& header() const;
  /// `count` samples from number `first` on, x fastest.
  void read(std::int64_t first, std::int64_t count, double* out);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdvr::io
