// Projections of phantoms and volumes: exact line integrals where the phantom has them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "vdvr/grid.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/projections.hpp"

namespace vdvr {

/// One ellipsoid, world units; rotated by phi about z. Densities of overlapping ellipsoids add.
struct Ellipsoid {
  double density = 1;
  Vec3 center{0, 0, 0};
  Vec3 semi_axes{1, 1, 1};
  double phi_deg = 0;
};

/// An object that can be projected: its density at a point and its line integral along x = u cos - s sin,
/// y = u sin + s cos, z = v.
struct Phantom {
  std::string name;
  double background = 0;
  std::vector<Ellipsoid> ellipsoids;                                           ///< exact line integrals
  std::function<double(const Vec3&)> density;                                  ///< the function itself, for comparison
  std::function<double(double theta_rad, double u, double v)> line_integral;   ///< exact or to quadrature accuracy
};

/// `scale`: world units per phantom unit (64 pixels for Shepp-Logan, 32/sqrt(2) for Marschner-Lobb at pitch 1).
Phantom marschner_lobb(double half_side);
Phantom shepp_logan(double unit);
Phantom sphere(double radius, double density = 1);
Phantom ellipsoid_list(std::vector<Ellipsoid> ellipsoids, double background, std::string name);
/// {"ellipsoids": [{"density", "center", "semi_axes", "phi_deg"}], "background"}. Throws FileError.
Phantom read_phantom(const std::filesystem::path& path);
/// The trilinear interpolation of a volume, zero outside; line integrals by exact traversal or fine quadrature.
Phantom volume_phantom(Volume volume);

struct SimulateOptions {
  int angles = 180;
  double arc_deg = 180;       ///< angles k * arc / angles
  std::int64_t columns = 129, rows = 129;
  double pitch_u = 1, pitch_v = 1;
  std::string unit = "pixel";
  bool band_limited = true;   ///< 16x finer line integrals in u, ideal low-pass at the detector's Nyquist, decimation
  double noise_sigma = 0;     ///< Gaussian, of the largest line integral, added on the detector
  std::uint64_t seed = 1;
};

/// Cost: angles * rows * columns (times 16 band-limited) line integrals, over all cores.
ProjectionSet simulate(const Phantom& phantom, const SimulateOptions& options, const Progress& progress = {});

}  // namespace vdvr
