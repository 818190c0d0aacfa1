// How far anybody's uniform volume W lies from F of a scan (docs/audit.md): registered first, then at W's
// samples and between them, where an attained lower and a certified upper end are given.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/region_of_interest.hpp"

namespace vdvr {

/// How W is read between its samples. Nearest: halfway between two samples both values count. Linear: in each
/// cell trilinear. Cubic: by Catmull and Rom (Keys' kernel, a = -1/2) along each axis, samples beyond the
/// volume being those at its edge.
enum class Between { nearest, linear, cubic };
constexpr const char* text_of(Between between) {
  return between == Between::nearest ? "nearest" : between == Between::linear ? "linear" : "cubic";
}
constexpr std::optional<Between> between_of(std::string_view text) {
  if (text == "nearest") return Between::nearest;
  if (text == "linear") return Between::linear;
  if (text == "cubic") return Between::cubic;
  return {};
}

struct AuditOptions {
  FieldOptions field;
  Between between = Between::linear;
  bool as_is = false;            ///< nothing is registered
  std::optional<double> radius;  ///< only points that near to the axis; world
  RegionOfInterest roi;          ///< only points of this box
  std::optional<double> within;  ///< the upper end is made as sharp as this needs
  bool within_share = false;     ///< `within` is a share of F's range at the samples
};

/// Over the cells of W whose eight samples are covered (and within radius and roi).
struct AuditFigures {
  std::int64_t samples = 0;               ///< compared
  std::pair<double, double> range{0, 0};  ///< of F at these samples
  double rms = 0;                         ///< of W - F at samples, F by `reconstruct` on the device
  double largest = 0;                     ///< largest |W - F| there, F in double precision
  Vec3 largest_at{0, 0, 0};               ///< world
  double lower = 0;                       ///< |W - F| at the worst point found, F in double precision
  Vec3 lower_at{0, 0, 0};                 ///< world
  double w_there = 0, f_there = 0;        ///< W and F at that point
  std::optional<double> upper;            ///< |W - F| exceeds it nowhere in these cells: proved
  std::string why_no_upper;               ///< one line, where there is none
  std::optional<double> within;           ///< as asked for, absolute
  int finest_rate = 0;                    ///< of the gold that `upper` was found on

  [[nodiscard]] double span() const { return range.second - range.first; }
};

/// W against F under the same turns, mirrors, factors, shifts, centres and windows: what it took to fit best.
struct Registration {
  std::array<int, 3> axes{0, 1, 2};                   ///< W's axis that runs along F's x, y, z
  std::array<bool, 3> mirrored{false, false, false};  ///< along F's x, y, z
  double scale = 1, offset = 0;                       ///< W = scale * F + offset
  Vec3 shift{0, 0, 0};                                ///< samples that W's content lies off
  double center = 0;                        ///< columns between the axis that fits and the one in use
  RampWindow window = RampWindow::ram_lak;  ///< that fits
  /// Share of W's variance that F under W's own settings does not explain, as it is and registered.
  double unexplained = 0, unexplained_registered = 0;
  /// A line for each thing that is off, as people say it. Only what is named here is put right.
  std::vector<std::string> words;
  std::string doubt;  ///< where W and F have little in common: nothing is named then
};

struct Audit {
  AuditFigures as_is;
  std::optional<Registration> registration;  ///< absent with AuditOptions::as_is
  std::optional<AuditFigures> registered;    ///< where something was named: of W when that is put right
};

/// Where a volume's samples lie, in the scan's unit; what is not said is the file's.
struct PlaceOptions {
  std::optional<Vec3> spacing;
  std::optional<Vec3> origin;  ///< of the first sample
};
struct PlacedVolume {
  Volume volume;
  std::string spacing_from, origin_from;  ///< "option", "file", or what stands for it
};
/// A grid of one pixel's spacing, or whose first sample lies at 0, 0, 0, says nothing of either, as files
/// without a place do: the spacing is then the detector's pitch at the axis, and the middle lies on the axis
/// at the middle of what all views see. Metres, centimetres, millimetres and micrometres of a file become the
/// scan's.
VDVR_API PlacedVolume placed_volume(Volume volume, const ProjectionSet& scan, const FieldOptions& field,
                                    const PlaceOptions& options);

/// Puts W where `registration` says that it belongs.
VDVR_API Volume registered_volume(const Volume& volume, const Registration& registration);

/// The best fit of F to W among the 48 turns and mirrors of the axes, shifts within two samples, factors and
/// offsets, centres within two columns and the windows of the ramp. What does not halve the unexplained
/// variance is not named. Cost: some 80 reconstructions of at most 32^3 samples. Throws InputError where
/// fewer than 100 samples are covered.
VDVR_API Registration register_volume(Device& device, const ProjectionSet& scan, const Volume& volume,
                                      const AuditOptions& options, const Progress& progress = {});

/// Cost: registration, a reconstruction of W's grid, and what an exhaustive `verify` takes (verify.hpp);
/// twice the latter two where something is named. Memory: W twice on the host and once on the device, and
/// verify's. Throws InputError where no cell of W is covered, ResourceError, DeviceError of a device that
/// failed its test.
VDVR_API Audit audit(Device& device, const ProjectionSet& scan, const Volume& volume,
                     const AuditOptions& options, const Progress& progress = {});

}  // namespace vdvr
