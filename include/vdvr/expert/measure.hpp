// Numbers measured on a certified volume, each as an interval that holds for every field within the bound, F
// among them (docs/measure.md): |V - F| <= e, brick by brick, at every covered point.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// A number lies in it; the ends are rounded outward.
struct Interval {
  double lo = 0, hi = 0;

  [[nodiscard]] double middle() const { return 0.5 * (lo + hi); }
  [[nodiscard]] double width() const { return hi - lo; }
};

/// Points whose distance from the centre, or across z from the upright line through it, is at most the
/// radius.
struct RoundRegion {
  Vec3 center{};
  double radius = 0;
  bool upright = false;
};

/// What is measured, world units: the points that lie in all that are given, in the covered cylinder, the
/// grid and the certificate's region of interest.
struct MeasureRegion {
  std::optional<std::array<double, 6>> box;  ///< x0, y0, z0, x1, y1, z1
  std::vector<RoundRegion> rounds;
  /// A point is in the mask where the nearest of its samples is not 0; none beyond its samples' cells.
  std::shared_ptr<const Volume> mask;
};

/// The values a <= F <= b; without either, all below or above the other.
struct ValueRange {
  std::optional<double> least, largest;
};

/// Of the points of the region where F is in a range.
struct VolumeMeasure {
  Interval volume;       ///< cubed unit of length
  Interval region;       ///< the volume of the region itself
  Interval fraction;     ///< of the region
  double undecided = 0;  ///< part of the width of `volume` that comes of geometry, not of the bound
};

struct MeanMeasure {
  Interval mean;      ///< of F over the region, density units
  Interval integral;  ///< of F over it: density times cubed unit of length
  Interval region;
  double bound = 0;  ///< the mean of e
};

/// The least and the largest F in the region.
struct ExtremesMeasure {
  Interval least, largest;
  Vec3 least_at{}, largest_at{};  ///< where V is least and largest
};

/// The distribution of F: volumes of {F >= edge} for all edges at once, and of what lies between two.
struct Distribution {
  std::vector<double> edges;
  std::vector<Interval> at_least;  ///< one an edge
  std::vector<Interval> within;    ///< one less: between an edge and the next
  Interval region;
};

struct MeasureOptions {
  /// Boxes are halved until what is undecided by geometry is below this share of the possible volume, or
  /// below a tenth of what the bound itself leaves open.
  double share = 1e-3;
};

namespace measured {
class Field;
}
struct ComponentsOptions;
struct ComponentTable;
struct LineOptions;
struct LineMeasure;
struct MeanOfScan;
struct MeanNoise;
struct ProjectionSet;

class VDVR_API Measurement {
 public:
  /// Refers to volume and certificate. Throws InputError: a volume that nothing certifies, of a window, of an
  /// earlier version without bounds by brick or without the covered region; a region without points.
  Measurement(const MixedVolume& volume, const Certificate& certificate, const MeasureRegion& region = {});
  ~Measurement();
  Measurement(Measurement&&) noexcept;
  Measurement& operator=(Measurement&&) noexcept;

  // Each on all cores, in time linear in the samples: about a second for 257^3. Throw Interrupted.

  /// Throws InputError for a range that is empty or not finite.
  [[nodiscard]] VolumeMeasure volume(const ValueRange& range, const MeasureOptions& options = {},
                                     const Progress& progress = {}) const;
  [[nodiscard]] MeanMeasure mean(const Progress& progress = {}) const;
  /// F's own mean over the region, and what noise leaves in it, by the projections that the volume was built
  /// of (mean_of_scan.hpp). Throws MismatchError as check_input(), ResourceError.
  [[nodiscard]] MeanOfScan mean_of_scan(const ProjectionSet& scan, const MeanNoise& noise,
                                        std::uint64_t max_memory_bytes = 0,
                                        const Progress& progress = {}) const;
  [[nodiscard]] ExtremesMeasure extremes(const Progress& progress = {}) const;
  /// `edges` ascend; throws InputError where they do not, or are fewer than two.
  [[nodiscard]] Distribution distribution(const std::vector<double>& edges,
                                          const Progress& progress = {}) const;
  /// Throws InputError as volume(), ResourceError where the table needs more than `max_memory_bytes`.
  [[nodiscard]] ComponentTable components(const ValueRange& range, const ComponentsOptions& options,
                                          const Progress& progress = {}) const;
  /// From p to q, as far as that is covered, in the certificate's region of interest and in the box; other
  /// regions do not cut it. Throws InputError for points that are not finite or one and the same.
  [[nodiscard]] LineMeasure along(const Vec3& p, const Vec3& q, const LineOptions& options) const;

  /// For the library's own use.
  [[nodiscard]] const measured::Field& field() const { return *field_; }

 private:
  std::unique_ptr<const measured::Field> field_;
};

}  // namespace vdvr
