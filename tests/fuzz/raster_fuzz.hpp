// What the programs for MetaImage and NRRD share: one file is read as a volume and as a stack of projections.
#pragma once

#include <zlib.h>

#include <stdexcept>

#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/volume_file.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr::fuzz {

inline std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  if (compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
               bytes.size()) != Z_OK)
    throw std::runtime_error("zlib cannot compress");
  out.resize(size);
  return out;
}

inline void read_raster(const std::filesystem::path& file, std::uint64_t limit) {
  static_cast<void>(read_volume(file, limit));
  ScanOptions options;
  options.max_memory_bytes = limit;
  options.angles_file = file.parent_path() / "angles.txt";
  options.input.values = SampleValues::line_integrals;
  static_cast<void>(read_scan(file, options));
}

inline void write_angles(const std::filesystem::path& folder) {
  std::ofstream(folder / "angles.txt") << "0\n60\n120\n";
}

}  // namespace vdvr::fuzz
