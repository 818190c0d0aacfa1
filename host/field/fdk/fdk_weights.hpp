// What cone-beam samples weigh before the ramp filter, and views in their sum (docs/geometry.md, "Cone
// beam").
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vdvr/expert/cone_geometry.hpp"

namespace vdvr {

/// Weights of FDK (Feldkamp, Davis and Kress 1984), as RTK has them: the cosine of each ray's angle, Parker's
/// or Wang's share of rays that are measured twice, a quarter of the gaps to both neighbouring views.
class FdkWeights {
 public:
  /// Throws InputError where views do not suffice: fewer than two, a short scan of less than 180 degrees and
  /// the fan, an axis that is not on the detector, the isocentre beside the source's plane.
  FdkWeights(const ConeGeometry& cone, std::int64_t columns, std::int64_t rows);

  /// Columns of zeros before the first and after the last, with which a displaced detector is symmetric about
  /// the axis.
  [[nodiscard]] std::int64_t pad_before() const { return pad_before_; }
  [[nodiscard]] std::int64_t pad_after() const { return pad_after_; }
  /// Of view k: radians, which add to about pi; over the pitch at the axis where the ramp is that of pitch 1.
  [[nodiscard]] double of_view(std::size_t k) const { return view_[k]; }
  [[nodiscard]] const ConeView& view(std::size_t k) const { return views_[k]; }
  /// out[row][pad_before + column + pad_after] = samples of view k times what each weighs.
  void apply(std::size_t k, std::span<const float> samples, std::span<double> out) const;
  /// The share of the rays through a column, 0 to 2; columns count from the detector's own first.
  [[nodiscard]] double redundancy(std::size_t k, double column) const;
  /// The cosine of the angle between the ray through a pixel and the line from the source to the axis.
  [[nodiscard]] double cosine(std::size_t k, double column, double row) const;

  /// For the user: wedges that no source was in (of a short scan its opening is none), gaps in doubt, views
  /// that share their weight.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  [[nodiscard]] double fan_angle(std::size_t k, double column) const;
  void check_short_scan() const;
  void pad_displaced();

  std::int64_t columns_, rows_, pad_before_ = 0, pad_after_ = 0;
  Redundancy redundancy_;
  SourceArc arc_;
  std::vector<ConeView> views_;
  std::vector<Vec3> to_axis_;  // from the source to the axis, in the plane of the orbit; unit length
  std::vector<double> view_, after_first_;  // the latter: angle since the first view of a short scan
  double overlap_fan_ = 0;                  // of a displaced detector: the fan that all see on both sides
  bool displaced_up_ = false;               // it reaches farther towards high columns
  std::vector<std::string> notes_;
};

}  // namespace vdvr
