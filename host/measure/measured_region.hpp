// The points that are measured: a box, round regions, a mask.
#pragma once

#include <cstdint>
#include <optional>

#include "host/measure/level_share.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/measure.hpp"

namespace vdvr {

enum class Place : std::uint8_t { outside, cut, inside };

class MeasuredRegion {
 public:
  /// Throws InputError: numbers that are not finite, a region that is empty, a file that does not say what is
  /// covered.
  MeasuredRegion(const Grid& grid, const Certificate& certificate, const MeasureRegion& asked);

  /// Everything lies in this box.
  [[nodiscard]] const Vec3& low() const { return low_; }
  [[nodiscard]] const Vec3& high() const { return high_; }

  /// The largest upright cylinder that is covered.
  [[nodiscard]] const CoveredCylinder& covered() const { return covered_; }

  /// Of a closed box, whatever lies within low() and high(): surely outside, surely inside, or neither.
  [[nodiscard]] Place place(const Vec3& low, const Vec3& high) const;
  /// Of a box within low() and high() that no plane of the mask cuts: the share that lies in the region.
  [[nodiscard]] Interval share(const Vec3& low, const Vec3& high) const;
  /// Whether the closed box surely holds a point of the region. False where that is not easily seen.
  [[nodiscard]] bool holds_point(const Vec3& low, const Vec3& high) const;
  /// A plane of the mask that cuts the box into parts which differ: its axis and place.
  struct Plane {
    std::size_t axis = 0;
    double at = 0;
  };
  [[nodiscard]] std::optional<Plane> mask_plane(const Vec3& low, const Vec3& high) const;
  /// Whether what the region has across z is the same at all heights between two of faces(2).
  [[nodiscard]] bool is_upright() const;
  /// Of an axis, ascending: where the region begins, the mask's faces within, where it ends.
  [[nodiscard]] std::vector<double> faces(std::size_t axis) const;
  /// The length in s of what the line p + s d has in the region. Of a mask the sum over its samples.
  [[nodiscard]] double length_along(const Vec3& p, const Vec3& d) const;

 private:
  [[nodiscard]] Place place_in_box(const Vec3& low, const Vec3& high) const;
  [[nodiscard]] Place place_in_mask(const Vec3& low, const Vec3& high) const;
  [[nodiscard]] double length_in_mask(const Vec3& p, const Vec3& d, double from, double to) const;
  [[nodiscard]] double mask_face(std::size_t axis, std::int64_t i) const;
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> mask_range(std::size_t axis, double low,
                                                                 double high) const;

  CoveredCylinder covered_;
  Vec3 low_{}, high_{};
  std::vector<RoundRegion> rounds_;
  std::shared_ptr<const Volume> mask_;
};

}  // namespace vdvr
