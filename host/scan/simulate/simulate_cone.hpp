// Rays of a cone-beam scan through a phantom.
#pragma once

#include <vector>

#include "vdvr/expert/cone_geometry.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr {

/// Throws InputError for a set-up that is no scan, or an object that slanted rays cannot be sent through.
void check_cone(const Phantom& phantom, const ConeSetup& cone);

/// The views that the options describe.
ConeGeometry cone_geometry_of(const SimulateOptions& options);

/// Mean of the line integrals between points of the source and of a pixel, whose sides are those of the
/// (fine) detector's pixels.
class ConeRays {
 public:
  /// Of view `view`. Keeps references to the phantom and the options.
  ConeRays(const Phantom& phantom, const SimulateOptions& options, int view);
  /// u and v: lengths on the detector, from its middle.
  [[nodiscard]] double operator()(double u, double v) const;

 private:
  [[nodiscard]] double through(double column, double row) const;

  const Phantom& phantom_;
  ConeView view_;
  const SimulateOptions& options_;
  std::vector<double> across_, along_, spot_;
};

}  // namespace vdvr
