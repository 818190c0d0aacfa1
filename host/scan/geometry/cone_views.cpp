// Checks that all geometry files share; see cone_views.hpp.
#include "host/scan/geometry/cone_views.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "host/scan/geometry/vectors.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {

ViewMatrix checked_view(const ViewMatrix& matrix, const std::string& where, std::int64_t view) {
  try {
    for (const auto& row : matrix)
      for (const double value : row)
        if (!std::isfinite(value)) throw InputError("the matrix holds a number that is not finite");
    const ViewMatrix out = normalised(matrix);
    static_cast<void>(cone_view(out));
    return out;
  } catch (const InputError& e) {
    throw FileError(fmt::format("{}: view {}: {}", where, view, e.what()));
  }
}

ViewMatrix checked_view(const CircularView& v, const std::string& where, std::int64_t number) {
  const auto require_positive = [&](const char* what, double value, const char* why) {
    if (!(value > 0) || !std::isfinite(value))
      throw FileError(fmt::format("{}: view {}: {} is {}; {}", where, number, what, value, why));
  };
  require_positive("the distance from source to axis", v.source_to_axis,
                   "the isocentre must lie before the source");
  require_positive("the distance from source to detector", v.source_to_detector,
                   "the detector must lie before the source");
  for (const auto& [what, pitch] :
       {std::pair{"the pitch of columns", v.pitch_u}, {"the pitch of rows", v.pitch_v}})
    require_positive(what, pitch, "it must be positive");
  return checked_view(circular_view(v), where, number);
}

// A point is source + t (middle + a u + b v - source) with (t a, t b, t) = [u v middle-source]^-1 (point -
// source).
ViewMatrix checked_view(const DetectorVectors& d, const StackShape& stack, const std::string& where,
                        std::int64_t number) {
  const Vec3 depth = sum(d.middle, scaled(d.source, -1));
  const std::array<Vec3, 3> rows{cross(d.along_v, depth), cross(depth, d.along_u),
                                 cross(d.along_u, d.along_v)};
  const double volume = dot(d.along_u, rows[0]);
  if (!(std::abs(volume) > 0))
    throw FileError(
        fmt::format("{}: view {}: the source lies in the detector's plane, or its columns and "
                    "rows are parallel",
                    where, number));
  // As far as the origin lies towards the detector.
  if (!(-dot(d.source, rows[2]) / volume > 0))
    throw FileError(
        fmt::format("{}: view {}: the isocentre lies on or behind the source's plane", where, number));
  const auto row = [&](std::size_t i) -> std::array<double, 4> {
    const Vec3& r = rows[i];
    return {r[0] / volume, r[1] / volume, r[2] / volume, -dot(r, d.source) / volume};
  };
  const std::array<double, 4> a = row(0), b = row(1), t = row(2);
  ViewMatrix matrix{};
  for (std::size_t j = 0; j < 4; ++j) {
    matrix[0][j] = a[j] + stack.middle_column() * t[j];
    matrix[1][j] = b[j] + stack.middle_row() * t[j];
    matrix[2][j] = t[j];
  }
  return checked_view(matrix, where, number);
}

void require_views(const std::string& where, const std::string& what, std::int64_t described,
                   const StackShape& stack) {
  if (described != stack.views)
    throw FileError(fmt::format("{}: {} {} for {} projections; one for each is needed", where, described,
                                what, stack.views));
}

void require_radians(const std::string& where, const std::string& what, const std::vector<double>& angles,
                     const std::string& remedy) {
  if (angles.size() < 3) return;
  const double span = std::abs(angles.back() - angles.front()),
               step = span / static_cast<double>(angles.size() - 1);
  constexpr double least = 90, half_turn = 180;
  if (!(span >= least)) return;
  for (const double end : {span, span + step})
    if (std::abs(end - half_turn * std::round(end / half_turn)) <= 0.01 * step)
      throw FileError(fmt::format("{}: {} run over {:g} in steps of {:.4g}: these are degrees, but {}", where,
                                  what, span, step, remedy));
}

void require_detector(const std::string& where, std::int64_t columns, std::int64_t rows,
                      const StackShape& stack) {
  if (columns != stack.columns || rows != stack.rows)
    throw FileError(fmt::format(
        "{}: a detector of {} columns x {} rows, but the projections have {} x {}; bin or crop the geometry "
        "as they were, or write it as 'geometry'",
        where, columns, rows, stack.columns, stack.rows));
}

}  // namespace vdvr::io
