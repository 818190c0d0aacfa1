// What the paper measures, as numbers: the error of filtered back-projection against the number of views
// (Fig. 3), certified volumes in its settings and in ours (Tables 1 and 2, Figs. 11, 12, 15), frames per
// second of one method against another. Called by the sections of the report and tests/paper/paper_test.cpp.
#pragma once

#include <functional>
#include <optional>

#include "apps/paper/error_measure.hpp"
#include "apps/paper/fields.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::paper {

/// Fig. 3 at one number of views; all against the function, interior.
struct ProjectionError {
  int angles = 0;
  ErrorMeasure upsampled;  ///< FBP from 8x upsampled projections, linear
  ErrorMeasure d2vr;       ///< bilinear between the detector's own samples
};
/// Cost: samples * angles updates for one and four times as many taps for the other.
ProjectionError projection_error(Device& device, int angles, const Index3& samples,
                                 const Progress& progress = {});

/// `paper_cells`: the paper's settings before its closing, refined cell by cell (granularity 1), as its Figs.
/// 7 to 9 show refinement; `paper_open`: before its closing, in bricks of 4 cells as its section 5 stores
/// them; `paper`: with it; `ours`: certified, the defaults.
enum class Settings { paper_cells, paper_open, paper, ours };
const char* text_of(Settings settings);

struct Case {
  Settings settings = Settings::ours;
  double epsilon = 0;  ///< as asked for
  Tolerance tolerance;
  bool epsilon_of_max = false;  ///< what a relative tolerance is of
  MixedVolume volume;
  Certificate certificate;
  SamplerKind sampler = SamplerKind::buffer;  ///< that its certificate allows on the device
  double seconds = 0;                         ///< plan and build, in memory
};
struct CaseOptions {
  Settings settings = Settings::ours;
  double epsilon = 0.03;
  /// In density units; otherwise of the reference range, as `--epsilon` is, or in the paper's settings of
  /// the field's maximum.
  bool absolute = false;
  std::optional<std::pair<double, double>> window;
};
/// Throws as make_plan and build do.
Case build_case(Device& device, const ProjectionSet& scan, const Grid& grid, const CaseOptions& options,
                const Progress& progress = {});

/// Over a turn about z, `frames` evenly spread views of `options` from its camera on; one more frame first,
/// which is not timed. `median` is of the frames.
struct Speed {
  double fps = 0;  ///< 1 / median seconds
  double seconds_min = 0, seconds_median = 0, seconds_max = 0;
  double samples_per_second = 0;
  int frames = 0;
};
Speed measure_speed(const std::function<RenderResult(const RenderOptions&)>& draw, RenderOptions options,
                    const Grid& grid, int frames, const Progress& progress = {});

/// The paper's timing view (512 x 512, step 1, lit) of a grid; the picture's transfer function is the
/// caller's.
RenderOptions timing_view(const Grid& grid);
Camera turned_camera(const Grid& grid, double azimuth_deg);

}  // namespace vdvr::paper
