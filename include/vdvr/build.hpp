// The certified volume from a scan: gold stream, classification, closing, packing, verification on the packed
// field.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "vdvr/mixed_volume.hpp"
#include "vdvr/plan.hpp"

namespace vdvr {

struct BuildOptions {
  int granularity = 4;
  std::optional<std::array<double, 6>> roi;  ///< x0,y0,z0,x1,y1,z1: certify and count only bricks inside
  std::optional<std::pair<double, double>> window;  ///< test only gold cells whose range meets [lo, hi]
  std::string closing = "coarse";                   ///< coarse | paper | none
};

/// Whether these options make a volume to compare with, which no certificate goes with.
inline bool is_comparison(const Plan& plan, const BuildOptions& options) {
  return plan.settings.terms != "all" || options.closing == "none";
}

struct BuildResult {
  MixedVolume volume;
  Certificate certificate;
  std::map<std::string, double> seconds;  ///< per stage
};

/// Throws ToleranceError when the tolerance is out of reach at the plan's rates.
BuildResult build(Device& device, const ProjectionSet& scan, const Plan& plan, const BuildOptions& options,
                  const Progress& progress = {});

}  // namespace vdvr
