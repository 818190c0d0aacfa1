// A scan of projections that are in memory already: for programs that have them from elsewhere, such as the
// Python module.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/sample_array.hpp"

namespace vdvr {

/// Parallel beam, as a file would describe it.
struct ArrayScan {
  std::int64_t rows = 0, columns = 0;
  std::vector<double> angles_deg;        ///< one per view
  std::optional<double> center;          ///< column of the axis; none: found from the views, else the middle
  std::optional<bool> half_acquisition;  ///< none: as axis and arc say
  Padding padding = Padding::none;
  std::optional<Heights> heights;  ///< of shifted rows; none: as views share them
  /// By view how far the sample stood towards higher columns and rows, in `unit`; empty: it only turned.
  std::vector<std::array<double, 2>> shifts{};
  double axis_roll_deg = 0;  ///< of the axis in the detector's plane; ParallelGeometry says which way
  double pitch_u = 1, pitch_v = 1;
  std::string unit = "pixel";
  std::string name = "array";  ///< what the certificate calls the input
};

/// Line integrals, float [view][row][column]. The scan that read_scan gives of the same values in a file, but
/// for its hash: that is over sizes, pitches, unit and angles, as text that reads back to the same bits, a
/// line end, and the samples, little-endian. Throws InputError naming what is not finite, not positive or
/// does not fit.
VDVR_API ProjectionSet scan_of_array(SampleArray data, const ArrayScan& described);

/// Angles that a file would have, of angles in radians: the degrees nearest to them.
VDVR_API std::vector<double> degrees_of(std::span<const double> radians);

/// One slice a detector row, of columns x columns samples a pitch apart, x and y, around the axis: the
/// samples of F that programs without a covered region give. Every slice lies at its row's height. A scan of
/// one row has a second plane a pitch above, which is to be dropped: a grid has a cell at least.
VDVR_API Grid slices_of_rows(const ParallelGeometry& geometry);

}  // namespace vdvr
