// What a geometry file says of a cone-beam scan, and what every such file is held to. Filled by the readers
// of this room.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vdvr/expert/cone_geometry.hpp"

namespace vdvr::io {

/// The stack that a geometry goes with.
struct StackShape {
  std::int64_t views = 0, rows = 0, columns = 0;

  [[nodiscard]] double middle_column() const { return 0.5 * static_cast<double>(columns - 1); }
  [[nodiscard]] double middle_row() const { return 0.5 * static_cast<double>(rows - 1); }
};

/// A flat detector and its source, as vectors of the world.
struct DetectorVectors {
  Vec3 source{}, middle{};    ///< of the rays, and of the detector
  Vec3 along_u{}, along_v{};  ///< from one column, and from one row, to the next
};

struct ConeViews {
  std::vector<ViewMatrix> views;   ///< one for each of the stack's views, lambda = 1 at the isocentre
  std::string center_source;       ///< "file", or "default" where the detector's middle was assumed
  std::string unit;                ///< of its lengths; empty where the format says nothing
  double source_to_detector = 0;   ///< 0 where the format does not say, or views differ
  std::vector<std::string> notes;  ///< what was assumed
  std::string if_at_edge;          ///< the likely cause, where the axis falls on the detector's first pixel
};

/// The matrix with lambda = 1 at the isocentre. Throws FileError ("where: view k: ...") unless it is that of
/// a camera whose rows and columns are at right angles.
ViewMatrix checked_view(const ViewMatrix& matrix, const std::string& where, std::int64_t view);
/// circular_view, whose lengths must be finite and positive.
ViewMatrix checked_view(const CircularView& view, const std::string& where, std::int64_t number);
/// The view whose rays run from the source to that detector. The isocentre is the world's origin.
ViewMatrix checked_view(const DetectorVectors& vectors, const StackShape& stack, const std::string& where,
                        std::int64_t number);
/// Throws FileError, which names `what`, unless as many views are described as there are.
void require_views(const std::string& where, const std::string& what, std::int64_t described,
                   const StackShape& stack);
/// Throws FileError where angles that a format has in radians are degrees: they reach beyond 14 turns, and
/// end on a multiple of 180, or a step before it, to a hundredth of the step.
void require_radians(const std::string& where, const std::string& what, const std::vector<double>& angles,
                     const std::string& remedy = "the format has radians; multiply them by pi / 180");
/// Remedy of that where no format, but a file or a user says radians.
inline const char* const not_radians = "they were taken for radians; state the unit by `angle_unit` degrees";
/// The same of the detector.
void require_detector(const std::string& where, std::int64_t columns, std::int64_t rows,
                      const StackShape& stack);

}  // namespace vdvr::io
