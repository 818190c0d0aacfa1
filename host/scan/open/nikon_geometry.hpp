// Nikon's .xtekct files: a scan's geometry, its white level, and where its projections lie.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/scan/geometry/cone_views.hpp"
#include "host/scan/geometry/description.hpp"

namespace vdvr::io {

/// Lengths in mm, angles in degrees, as the file has them.
struct NikonScan {
  std::filesystem::path path;
  std::string name, input_folder;
  std::int64_t projections = 0, columns = 0, rows = 0;
  double source_to_object = 0, source_to_detector = 0, pixel_x = 0, pixel_y = 0;
  double initial_angle = 0, angular_step = 0, white_level = 0;
  double center_top = 0, center_bottom = 0;  ///< CentreOfRotationTop and -Bottom, on the detector
  std::optional<double> object_offset, object_roll;
  double object_tilt = 0, detector_offset_x = 0, detector_offset_y = 0;
};

/// Throws FileError: a member that is missing or no number, lengths that are not positive.
NikonScan read_nikon(const std::filesystem::path& path);

/// Names of its TIFF files relative to the folder of `scan`, in natural order: those that begin with its Name
/// in InputFolderName or else beside the file. Throws FileError where their number is not Projections.
std::vector<std::string> nikon_projections(const NikonScan& nikon, const Description& scan);

ConeViews nikon_geometry(const NikonScan& nikon, const StackShape& stack);

}  // namespace vdvr::io
