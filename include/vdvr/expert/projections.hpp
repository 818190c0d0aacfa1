// A scan: projections with their geometry (docs/geometry.md). Parallel beam:
//
// Detector pixel (column i, row j) has its centre at integer (i, j). The rotation axis projects onto column
// `center` (+ column_shift of the view). u = (i - center) pitch_u, v = (j - (rows - 1)/2) pitch_v, t = x
// cos(theta) + y sin(theta), z = v.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/cone_geometry.hpp"
#include "vdvr/expert/preparation_steps.hpp"
#include "vdvr/expert/sample_array.hpp"

namespace vdvr {

/// An axis that leans farther, against the detector's columns, is a detector that was put in another way.
inline constexpr double most_axis_roll_deg = 10;
/// Throws InputError, which begins with `source`, for a roll beyond it or one that is no number.
VDVR_API void require_axis_roll(double degrees, const std::string& source);

/// What rows have beyond the detector's own columns (extend_rows.hpp), and how their samples were weighted.
struct RowExtension {
  /// True: rows are weighted as those of half acquisition; false: it was stated that they are none.
  std::optional<bool> half_acquisition;
  Padding padding = Padding::none;
  std::int64_t before = 0, after = 0;  ///< columns added on either side
  double center = 0;                   ///< column of the axis among the detector's own, where any were added
  /// Views that saw other heights were brought to those that all see, and those of a leaning axis upright.
  bool common_heights = false;
  std::int64_t cut = 0;  ///< columns left out on either side, where rows were brought upright
  bool operator==(const RowExtension&) const = default;
};

/// Views that saw the sample at other heights and became a scan of all heights
/// (host/scan/prepare/series_of_heights.hpp): how they were measured. With d_k = row_shift[k] height n lies
/// at row n - d_0 + d_k of view k.
struct HeightSeries {
  std::int64_t rows = 0;                     ///< of the detector; 0: no series
  std::int64_t first = 0;                    ///< the height of the scan's first row
  bool full_turn = false;                    ///< opposite views do not see the same: of half acquisition
  std::vector<double> theta_rad, row_shift;  ///< by measured view
  std::vector<double> column_shift;          ///< the same, or empty

  [[nodiscard]] bool none() const { return rows == 0; }
  bool operator==(const HeightSeries&) const = default;
};

struct ParallelGeometry {
  std::int64_t columns = 0;  ///< U
  std::int64_t rows = 0;     ///< V
  double pitch_u = 1.0;      ///< world units per column
  double pitch_v = 1.0;      ///< world units per row
  double center = 0.0;       ///< column onto which the rotation axis projects; (U - 1)/2 in a centred scan
  std::string unit = "pixel";
  std::vector<double> theta_rad;  ///< one angle per view
  RowExtension extension{};       ///< `columns` and `center` count the columns that it added or left out
  /// By view how far the sample stood towards higher columns, in columns: view k sees the axis at column
  /// center + column_shift[k]. Empty: it only turned.
  std::vector<double> column_shift{};
  /// The same towards higher rows, in rows, of rows as they were measured. `rows` are those of common heights
  /// where `extension` says so; F is made of such rows alone.
  std::vector<double> row_shift{};
  /// Of the axis against the detector's columns, in its plane: at higher rows a positive roll has the axis at
  /// higher columns. Where `extension` says that rows are upright, everything else here is of these rows.
  double axis_roll_deg = 0;
  /// Of a series of heights; `theta_rad` and `rows` are then those that it became, and no row is shifted.
  HeightSeries series{};

  [[nodiscard]] double center_of_view(std::size_t k) const {
    return column_shift.empty() ? center : center + column_shift[k];
  }
  [[nodiscard]] std::int64_t views() const { return static_cast<std::int64_t>(theta_rad.size()); }
  bool operator==(const ParallelGeometry&) const = default;
};

/// What reading and pre-processing did, reported to the user and stored with the certificate.
struct InputReport {
  std::string name;                ///< file or folder name as given, without its directory
  std::string sha256;              ///< of the file, or of a folder's sorted lines "sha256 name"
  std::string format;              ///< "data-exchange", "nxtomo", "scan.json", "mha", "simulated"
  std::int64_t dead_pixels = 0;    ///< samples replaced by the median of their neighbours
  double transmission_floor = 0;   ///< the floor under -log
  std::string center_source;       ///< "file", "option", "found", "default"
  double source_to_detector = 0;   ///< of cone beam, in world units; 0: not stated, as matrices do not
  bool air_background = false;     ///< a linear air background was fitted and taken off
  Preparation preparation;         ///< what else was done to the projections
  std::vector<std::string> notes;  ///< one line each, shown to the user
};

/// Line integrals, float data[view][row v][column u].
struct ProjectionSet {
  /// The detector, and where rays are parallel all there is to say. Of a cone-beam scan its limit for a
  /// source infinitely far away: pitches at the axis, and angles and centre of the matrices.
  ParallelGeometry geometry;
  std::optional<ConeGeometry> cone;  ///< none: rays are parallel
  SampleArray data;
  InputReport report;

  [[nodiscard]] std::int64_t size() const { return geometry.views() * geometry.rows * geometry.columns; }
};

/// What `geometry` of a cone-beam scan is.
VDVR_API ParallelGeometry parallel_limit(const ConeGeometry& cone, std::int64_t columns, std::int64_t rows,
                                         const std::string& unit);
/// Throws InputError, which names what is wanted, for a cone-beam scan.
VDVR_API void require_parallel(const ProjectionSet& scan, const std::string& what);

}  // namespace vdvr
