// The pictures of `plan --pictures DIR`: what interpolation does to the frequencies of this scan, after
// Figs. 4 and 5 of the paper. Called by plan.cpp.
#pragma once

#include "apps/vdvr/output.hpp"
#include "vdvr/device.hpp"
#include "vdvr/image.hpp"
#include "vdvr/plan.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/projections.hpp"

namespace vdvr::cli {

struct PlanPicture {
  std::string file, shows;
  Image image;
};
struct PlanPictures {
  std::vector<PlanPicture> pictures;
  Json json;  ///< what they show, as numbers
};
/// Cost: the ramp filter once more, the cosine spectrum of the 1x base volume (samples * sides
/// multiply-adds), five maps per spectrum.
PlanPictures plan_pictures(Device& device, const ProjectionSet& scan, const Plan& plan,
                           const Progress& progress);

/// Every file that will be written; pictures.json comes last and says that the folder is complete.
std::vector<std::string> plan_picture_names();

/// Draws and writes them; the content of pictures.json.
Json draw_plan_pictures(Device& device, OutputFolder& folder, const ProjectionSet& scan, const Plan& plan,
                        const Progress& progress);

}  // namespace vdvr::cli
