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

#include "host/geometry/cone_views.hpp"

namespace vdvr::io {

/// Frames of rows x columns samples.
struct Frames {
  std::int64_t count = 0;
  std::function<void(std::int64_t first, std::int64_t n, double* out)> read;  ///< double out[n][row][column]
  std::function<std::string(std::int64_t)> name;                              ///< of one frame, for messages
};

/// What makes a scan one of cone beam.
struct RawCone {
  ConeViews geometry;                    ///< one view for each projection
  std::string member;                    ///< of scan.json, which brought it
  std::optional<Redundancy> redundancy;  ///< where scan.json states it
};

struct RawScan {
  std::string format;  ///< "data-exchange", "nxtomo", "scan.json", "mha", "nrrd"
  std::int64_t rows = 0, columns = 0;
  std::vector<double> theta_deg;     ///< parallel beam: one a view
  std::optional<RawCone> cone;       ///< then `center` is where scan.json moves the axis to
  Frames projections, flats, darks;  ///< flats and darks only with counts
  bool counts = true;                ///< false: line integrals
  bool integer = false;              ///< counts are whole numbers
  std::optional<double> center;
  double pitch_u = 1, pitch_v = 1;
  std::string unit = "pixel";
  std::vector<std::pair<std::int64_t, std::int64_t>> air_columns;  ///< inclusive
  std::vector<std::pair<std::string, std::filesystem::path>>
      files;  ///< name in the hash, path; every file read
  std::vector<std::string> notes;
};

/// Keeps the views first .. last - 1 and their geometry.
inline void select_views(RawScan& scan, std::int64_t first, std::int64_t last) {
  const Frames all = scan.projections;
  scan.projections.count = last - first;
  scan.projections.read = [all, first](std::int64_t k, std::int64_t n, double* out) {
    all.read(first + k, n, out);
  };
  scan.projections.name = [all, first](std::int64_t k) { return all.name(first + k); };
  const auto keep = [first, last](auto& list) {
    list.erase(list.begin() + last, list.end());
    list.erase(list.begin(), list.begin() + first);
  };
  if (scan.cone) keep(scan.cone->geometry.views);
  else keep(scan.theta_deg);
}

}  // namespace vdvr::io
