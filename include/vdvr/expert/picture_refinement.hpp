// Volumes refined for pictures: bricks as fine as pixels of given views need them, and no finer
// (docs/pixel-bounds.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/camera.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {

/// Either a camera, or an orbit around the grid.
struct WantedView {
  std::optional<Camera> camera;
  double azimuth_deg = 30, elevation_deg = 20, zoom = 1;
};

/// Unlit pictures of mode dvr.
struct WantedViews {
  std::vector<WantedView> views;
  std::int64_t width = 256, height = 256;
  std::string transfer;  ///< a preset or a file; empty: what suits the volume
  std::optional<std::pair<double, double>> transfer_range;
  std::array<double, 3> background_top{0.13, 0.14, 0.16}, background_bottom{0.03, 0.03, 0.04};
  std::string sha256;  ///< of the file they were read from
};

/// {"size": [W, H], "tf": NAME or FILE (beside the file itself), "tf_range": [LO, HI], "background": 3 or 6
/// numbers, "views": [{"azimuth", "elevation", "zoom"} or {"position", "focal_point", "view_up",
/// "view_angle"}]}. Throws FileError naming the member.
VDVR_API WantedViews read_views(const std::filesystem::path& path);

/// The same with what depends on the volume: cameras, and a transfer function per base cell.
struct PictureViews {
  std::vector<Camera> cameras;
  std::int64_t width = 0, height = 0;
  TransferFunction transfer;
  std::array<double, 3> background_top{}, background_bottom{};
};
VDVR_API PictureViews views_of(const WantedViews& wanted, const MixedVolume& volume);

/// What was found of a volume in one round of refinement.
struct PictureRound {
  double worst = 0, mean = 0;  ///< bounds of pixels, levels of 255
  double over = 0;             ///< share of the pixels above the tolerance
  std::uint64_t samples = 0;   ///< of the volume
  std::size_t asked = 0;       ///< bricks that something less is asked of
};

struct PictureRefinementOptions {
  double levels = 8;  ///< what a pixel may differ by from the ideal one's, of 255
  int most_rounds = 12;
  double finest_abs = 0;  ///< the least bound that a brick is asked for
};

/// Looks at volumes, and asks less of |V - F| in bricks by their share in pixels that are above the
/// tolerance.
class VDVR_API PictureRefinement {
 public:
  /// The scan's projections are not looked at.
  PictureRefinement(WantedViews views, const ProjectionSet& scan, const FieldOptions& field,
                    PictureRefinementOptions options, Progress progress = {});
  ~PictureRefinement();
  PictureRefinement(const PictureRefinement&) = delete;
  PictureRefinement& operator=(const PictureRefinement&) = delete;

  /// For BuildOptions; refers to this object.
  [[nodiscard]] Refinement refinement(double everywhere_abs);
  /// Of the volumes that were looked at, in order.
  [[nodiscard]] const std::vector<PictureRound>& rounds() const;
  /// Whether the last of them is within the tolerance.
  [[nodiscard]] bool met() const;
  /// As the last volume had them.
  [[nodiscard]] const PictureViews& views() const;
  /// Says in the certificate what the volume was refined for, and how far that came.
  void note(Certificate& certificate) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What a build that is refined for pictures is foreseen to take.
struct PictureForecast {
  /// As pictures of F show them, at no more than a quarter of the pixels where there are many.
  std::vector<PictureRound> rounds;
  double samples_ratio = 0;  ///< stored per base sample, as Plan::samples_ratio
  std::uint64_t bytes = 0;   ///< of samples, before compression
  std::uint64_t memory_bytes = 0;
  double seconds = 0;
  double least = 0, median = 0, largest = 0;  ///< bounds of bricks that may be asked, world units
};

/// Goes through the rounds of the build with what second differences of F say of each level, compared with
/// what some bricks were measured to err, and no gold besides. `plan`: made to foresee
/// (PlanSettings::forecast) and not from a part of the scan, with `everywhere` as the tolerance that holds
/// everywhere; its epsilon is the least that is asked of a brick. Cost: a plan's look at some bricks, and
/// some rounds' pictures.
VDVR_API PictureForecast forecast_pictures(Device& device, const ProjectionSet& scan, const Plan& plan,
                                           const WantedViews& wanted, const PictureRefinementOptions& options,
                                           double everywhere_abs, StorageChoice storage,
                                           const Progress& progress = {});

}  // namespace vdvr
