// What interpolation does to the frequencies of a scan, after Figs. 4 and 5 of the paper: spectra, maps of
// worst errors, and their products. For comparison; it decides nothing.
#pragma once

#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/plan.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

struct PlanPicture {
  std::string file, shows;  ///< a name that says which it is, and one line
  Image image;
};
struct PlanPictures {
  std::vector<PlanPicture> pictures;
  std::string json;  ///< what they show, as numbers: a JSON object
};
/// row.png, projection-{spectrum,map,product}.png and volume-{spectrum,map,product}.png, in this order, of
/// the view with the most energy after filtering and of the plan's 1x volume. Cost: the ramp filter once
/// more, the cosine spectrum of the 1x base volume (samples * sides multiply-adds), five maps per spectrum.
VDVR_API PlanPictures plan_pictures(Device& device, const ProjectionSet& scan, const Plan& plan,
                                    const Progress& progress = {});

}  // namespace vdvr
