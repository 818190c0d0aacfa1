// A scan as its files hold it, before pre-processing: geometry, and frames that are read when asked for, so
// that no more than a block of them is in memory as double. Made by hdf5_scan, scan_folder and raster_scan;
// used by host/scan/read_scan.cpp and host/scan/preprocess.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/scan/geometry/cone_views.hpp"
#include "vdvr/expert/understood.hpp"

namespace vdvr::io {

/// Frames of rows x columns samples.
struct Frames {
  std::int64_t count = 0;
  std::function<void(std::int64_t first, std::int64_t n, double* out)> read;  ///< double out[n][row][column]
  std::function<std::string(std::int64_t)> name;                              ///< of one frame, for messages
};

/// Frames that all hold one number: flats and darks of which only the level is known.
Frames level_frame(double level, std::int64_t samples, const std::string& name);

/// Angles of this unit, in degrees.
std::vector<double> in_degrees(std::vector<double> angles, AngleUnit unit);

/// What makes a scan one of cone beam.
struct RawCone {
  ConeViews geometry;                    ///< one view for each projection
  std::string member;                    ///< of scan.json, which brought it
  std::optional<Redundancy> redundancy;  ///< where scan.json states it
};

/// Where the sample was in each view, along one axis.
struct SamplePositions {
  std::string object;      ///< the file's name for it
  std::string unit;        ///< of its lengths
  std::vector<double> at;  ///< one a view, as the views are
};

/// When frames were taken, and how bright the beam was. Each list is empty where nobody says it.
struct BeamInTime {
  std::vector<double> projections_at, flats_at;            ///< places in the order of frames
  std::vector<double> projection_currents, flat_currents;  ///< of any unit
  std::string currents;                                    ///< the file's name for them
};

struct RawScan {
  std::string format;  ///< "data-exchange", "nxtomo", "scan.json", "mha", "nrrd"
  std::int64_t rows = 0, columns = 0;
  AngleUnit angle_unit = AngleUnit::degrees;     ///< of angles that options or scan.json bring
  std::vector<double> theta_deg;                 ///< parallel beam: one a view
  std::optional<RawCone> cone;                   ///< then `center` is where scan.json moves the axis to
  Frames projections, flats, darks;              ///< flats and darks: count 0 where there are none
  std::string no_flats, no_darks;                ///< why there are none, for messages
  std::optional<double> flat_level, dark_level;  ///< where one number stands for them
  BeamInTime beam_in_time;
  bool counts = true;    ///< false: line integrals
  bool integer = false;  ///< values are whole numbers
  SampleValues values = SampleValues::counts;
  std::optional<SampleValues> stated;  ///< what the file or scan.json says that values are
  std::string values_source;           ///< who says it
  std::optional<double> center;
  std::optional<bool> half_acquisition;  ///< what the file or scan.json says
  double pitch_u = 1, pitch_v = 1;
  bool pitch_stated = false;
  std::string unit = "pixel";
  std::vector<SamplePositions> positions;
  std::vector<double> shift_u, shift_v;  ///< by view, in `unit`, where options or scan.json state them
  std::string shifts_source;             ///< who does; not empty: positions do not count
  double axis_roll_deg = 0;
  std::string axis_roll_source;                                    ///< who states it; empty: nobody
  std::vector<std::pair<std::int64_t, std::int64_t>> air_columns;  ///< inclusive
  std::vector<std::pair<std::string, std::filesystem::path>>
      files;                            ///< name in the hash, path; every file read
  std::vector<std::string> view_files;  ///< of TIFF: by view its file, in `folder`; not yet among `files`
  bool shared_files = false;            ///< one of these holds several views
  std::filesystem::path folder;
  std::vector<std::int64_t> numbers;  ///< of the projections used, as the file has them; empty: all
  std::vector<std::string> notes;
  std::vector<std::string> warnings;  ///< notes that make F doubtful
  std::vector<Assumption> assumed;

  /// The number by which its file knows a view.
  [[nodiscard]] std::int64_t number(std::int64_t view) const {
    return numbers.empty() ? view : numbers[static_cast<std::size_t>(view)];
  }
};

/// Where flats were taken, by the number of projections before each. Throws FileError, which begins with
/// `name`, for a number that is not whole or beyond the projections.
void place_flats(RawScan& scan, const std::vector<double>& projections_before, const std::string& name);

/// Shifts that somebody states, one number (columns) or two (and rows) a view, one after another. Throws
/// FileError, which begins with `source`, for another count of numbers or one that is not finite, and for
/// cone beam.
void state_shifts(RawScan& scan, const std::vector<double>& numbers, const std::string& source);

/// The axis' roll that somebody states. Throws FileError, which begins with `source`, for one that is not
/// within most_axis_roll_deg, and for cone beam.
void state_axis_roll(RawScan& scan, double degrees, const std::string& source);

/// Keeps the views of these ranges and their geometry. Throws InputError as checked_ranges.
void select_views(RawScan& scan, const ViewRanges& ranges);

}  // namespace vdvr::io
