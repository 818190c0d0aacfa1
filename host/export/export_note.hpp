// What an exported file says about itself beside its samples: where they lie, what they stand for, and what
// the certificate promises of them.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "vdvr/export_volume.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

struct ExportNote {
  Grid grid;
  SampleType samples = SampleType::f32;
  double scale = 1, offset = 0;
  double lowest = 0, highest = 0;  ///< of the values; found where a format shows it
  bool range_is_known = false;     ///< false of planes that are still to come
  bool exact_between_samples = false;
  double jump = 0;         ///< as in ExportResult; found where the samples hold all of V
  bool certified = false;  ///< false for the record of a comparison, which promises nothing
  double epsilon = 0, epsilon_abs = 0;
  std::string content_sha256;  ///< of the .vdvr; empty of a volume that never was one
};

/// Of a volume without a certificate. Throws InputError for a unit that would break out of a header's line.
ExportNote note_of(const Grid& grid);
/// `grid` is of the exported samples.
ExportNote note_of(const VdvrFile& file, const Grid& grid);

/// "float32", "uint16", "uint8".
const char* numpy_name(SampleType type);
std::size_t bytes_of(SampleType type);

/// What promises the certificate: epsilon, epsilon_abs, content_sha256; `certified` false without the two.
nlohmann::ordered_json certificate_note(const ExportNote& note);
/// All of it, for volume.json and NAME.json. `name` is the file that it speaks of.
nlohmann::ordered_json note_json(const ExportNote& note, const std::string& name);
/// The same as ImageJ has it: lines of key=value that say unit, spacing, origin, and what integers stand for.
std::string imagej_text(const ExportNote& note, std::int64_t images);

}  // namespace vdvr
