// What `run --above C` measures, and its section of report.html. Called by run.cpp and report.cpp.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common/output_folder.hpp"
#include "apps/vdvr/options.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/components.hpp"
#include "vdvr/expert/measure.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr::cli {

struct MeasuredByRun {
  std::string what;  ///< "F at least 0.5"
  ValueRange range;
  std::string why_not;  ///< where nothing can be measured; the rest is empty then
  VolumeMeasure volume;
  ComponentTable components;
};

/// --above and --below.
void add_measured(Arguments& args);
/// Nothing where neither is given. Throws InputError for both, and beside --window.
std::optional<MeasuredByRun> asked_to_measure(const Arguments& args);
/// Fills it and draws the slice at a height: measured.png, and components.png in the places' own colours.
void measure_for_run(MeasuredByRun& measured, const MixedVolume& volume, const Certificate& certificate,
                     double height, std::int64_t side, const OutputFolder& folder, const Progress& progress);

Json measured_json(const MeasuredByRun& measured);
std::vector<std::string> measured_lines(const MeasuredByRun& measured, const std::string& unit);
std::string measured_section(const MeasuredByRun& measured, const std::string& unit);

}  // namespace vdvr::cli
