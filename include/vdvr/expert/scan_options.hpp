// What is asked of files that hold a scan (docs/inputs.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/input_statement.hpp"
#include "vdvr/expert/preparation_steps.hpp"

namespace vdvr {

/// How the rays of a scan run that says so only by its distances.
enum class Beam { parallel, cone };
VDVR_API const char* text_of(Beam beam);
VDVR_API std::optional<Beam> beam_of(const std::string& text);

struct ScanOptions {
  std::optional<std::filesystem::path> angles_file;  ///< for stacks and HDF5 files; degrees, one per view
  /// Overrides the file's; in columns of the projections as they are prepared, binned ones where they are.
  std::optional<double> center;
  /// How far the sample stood in each view towards higher columns [and rows], in the scan's unit: a file of
  /// numbers, or FILE.h5:/dataset; "none": it stood still, whatever the files say; empty: as they say.
  std::string shifts;
  Preparation preparation;  ///< what is done to the projections
  InputStatement input;     ///< wins over what the files say
  /// Cone: by the distances of an NXtomo file, which is read as parallel beam otherwise. Refused where there
  /// are none, and beside another description of the geometry.
  std::optional<Beam> beam;
  std::uint64_t max_memory_bytes = 0;  ///< 0: no limit
  /// Folder of the scratch files that hold a scan of more than an eighth of the limit, and what is made of it
  /// as a whole; empty: default_scratch_folder().
  std::filesystem::path scratch;
  /// External links and virtual datasets of an HDF5 file may lead out of the scan's folder. What they lead to
  /// is hashed either way.
  bool follow_links = false;
};

}  // namespace vdvr
