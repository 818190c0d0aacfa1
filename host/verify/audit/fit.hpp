// F on a thinned grid of a volume, under other centres, windows and shifts, and how well it explains the
// volume.
#pragma once

#include <vector>

#include "host/field/fbp/coverage.hpp"
#include "vdvr/expert/audit.hpp"

namespace vdvr {

/// W = scale * F + offset, by least squares.
struct LinearFit {
  double scale = 0, offset = 0;
  double unexplained = 1;   ///< share of W's variance
  double offset_alone = 0;  ///< with a scale of 1
  /// Unexplained where the scale is 1, where the offset is 0, and both.
  double without_scale = 1, without_offset = 1, without_both = 1;
};

/// Of pairs w, f; W that is constant is explained by nothing.
LinearFit linear_fit(const std::vector<double>& w, const std::vector<double>& f);

/// What F is computed with.
struct FitSettings {
  Vec3 shift{0, 0, 0};  ///< samples that W's content lies off
  double center = 0;    ///< columns beside the one in use
  RampWindow window = RampWindow::ram_lak;
  bool operator==(const FitSettings&) const = default;
};

/// At most 33 samples along each axis, as far from each other as they may.
class ThinnedGrid {
 public:
  /// Those count whose place is covered, and within what options ask for, with as many as `room` samples
  /// around them. Throws InputError where fewer than 100 do.
  ThinnedGrid(const Grid& grid, const Coverage& coverage, const AuditOptions& options, double room);

  [[nodiscard]] const Grid& grid() const { return thin_; }
  /// Samples of the volume's own grid, and the same in the thinned one.
  [[nodiscard]] const std::vector<Index3>& samples() const { return samples_; }
  /// F there. Cost: a reconstruction.
  [[nodiscard]] std::vector<double> field(Device& device, const ProjectionSet& scan,
                                          const FieldOptions& field, const FitSettings& settings) const;

 private:
  Grid thin_;
  Vec3 spacing_{1, 1, 1};  // of the volume
  std::vector<Index3> samples_;
  std::vector<std::size_t> places_;  // in the thinned grid
};

}  // namespace vdvr
