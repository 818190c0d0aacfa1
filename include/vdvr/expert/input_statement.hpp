// What a user states of a scan that its files do not say, or say otherwise: by options of a command, or by
// members of scan.json (docs/inputs.md). Recorded in the certificate's `options`, stated again by whoever
// reads the scan to verify it.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"

namespace vdvr {

/// What the frames of a scan hold. Transmissions are counts less the dark, over those of the open beam.
enum class SampleValues { counts, transmission, line_integrals };
/// "counts", "transmission", "line integrals".
VDVR_API const char* text_of(SampleValues values);
VDVR_API std::optional<SampleValues> sample_values_of(const std::string& text);

/// What the angles of a scan are counted in.
enum class AngleUnit { degrees, radians };
/// "degrees", "radians".
VDVR_API const char* text_of(AngleUnit unit);
VDVR_API std::optional<AngleUnit> angle_unit_of(const std::string& text);

/// Half-open ranges of projections, counted from 0 as the file has them.
using ViewRanges = std::vector<std::pair<std::int64_t, std::int64_t>>;
/// As an end: up to the last.
inline constexpr std::int64_t last_view = std::numeric_limits<std::int64_t>::max();
/// "0:40,41:90", "41:", ":40", "7"; throws InputError naming what is no range.
VDVR_API ViewRanges view_ranges_of(const std::string& text);
/// And back.
VDVR_API std::string text_of(const ViewRanges& ranges);
/// Those of `count` views; throws InputError for ranges that are empty, out of order, overlap or end beyond.
VDVR_API ViewRanges checked_ranges(ViewRanges ranges, std::int64_t count);

struct InputStatement {
  std::string entry;           ///< group of an HDF5 file that holds the scan; empty: the only one
  ViewRanges views;            ///< the projections used; empty: those that scan.json says, else all
  std::optional<double> dark;  ///< counts without beam, in place of darks
  std::optional<double> flat;  ///< counts of the open beam, in place of flats
  std::optional<SampleValues> values;
  std::optional<AngleUnit> angle_unit;  ///< whatever the file of the angles says
  /// Of an HDF5 file: the dataset of the beam's current in each frame, or "none"; empty: the usual one.
  std::string beam_current{};
  /// Of the axis of parallel beam, in the detector's plane (ParallelGeometry), whatever the files say.
  std::optional<double> axis_roll_deg{};

  [[nodiscard]] bool none() const { return *this == InputStatement{}; }
  bool operator==(const InputStatement&) const = default;
};

/// "entry entry0001; views 0:40,41:90; darks 0; line integrals; angles in radians"; "none".
VDVR_API std::string text_of(const InputStatement& statement);

}  // namespace vdvr
