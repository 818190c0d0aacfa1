// Projections of phantoms and volumes: exact line integrals where the phantom has them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr {

/// One ellipsoid, world units; rotated by phi about z. Densities of overlapping ellipsoids add.
struct Ellipsoid {
  double density = 1;
  Vec3 center{0, 0, 0};
  Vec3 semi_axes{1, 1, 1};
  double phi_deg = 0;
};

/// An object that can be projected: its density at a point and its line integral along x = u cos - s sin,
/// y = u sin + s cos, z = v. The functions own what they need and may be called from several threads at once.
struct Phantom {
  std::string name;
  double background =
      0;  ///< constant density everywhere; such an object has no line integrals unless it is 0
  std::vector<Ellipsoid> ellipsoids;  ///< what the functions below were made from, where it is a list
  std::function<double(const Vec3&)> density;  ///< the function itself, for comparison
  std::function<double(double theta_rad, double u, double v)>
      line_integral;  ///< exact or to quadrature accuracy
  /// One view at a time, out[v][u], every element written; the same numbers as `line_integral` to rounding,
  /// but what a view's rows share is computed once. May be empty: `line_integral` is called for each ray
  /// then.
  std::function<void(double theta_rad, std::span<const double> u, std::span<const double> v,
                     std::span<double> out)>
      view_integrals;
  /// Along the whole line through a point in a direction of unit length, of cone-beam rays. May be empty.
  std::function<double(const Vec3& point, const Vec3& direction)> ray_integral;
  std::string description;  ///< canonical text of everything that defines the object; hashed into the report
};

/// Marschner-Lobb's function on |x|, |y| <= half_side (world units), zero outside in x and y, continued in z
/// over all rows. The paper's set-up: half_side 32/sqrt(2) at pitch 1. Gauss-Legendre quadrature to rounding.
/// Throws InputError.
VDVR_API Phantom marschner_lobb(double half_side);
/// Modified 3D Shepp-Logan with thin tumours (docs/phantoms.md); `unit`: world units per phantom unit, 64 at
/// pitch 1. Throws InputError.
VDVR_API Phantom shepp_logan(double unit);
/// A ball on the axis. Throws InputError unless radius > 0.
VDVR_API Phantom sphere(double radius, double density = 1);
/// A body of density 1 about the axis with so many pores of density 0 within +-half_height: balls of radii
/// from 0.02 to 0.1 of the body's, apart by 0.01 of it at least. Pores are the ellipsoids behind the first;
/// the same seed gives the same ones everywhere. Throws InputError where there is no room for them.
VDVR_API Phantom foam(double radius, double half_height, int pores, std::uint64_t seed);
/// Throws InputError for an empty list, a semi-axis that is not positive, or a value that is not finite.
VDVR_API Phantom ellipsoid_list(std::vector<Ellipsoid> ellipsoids, double background, std::string name);
/// {"ellipsoids": [{"density", "center", "semi_axes", "phi_deg"}], "background"}; phi_deg and background
/// default to 0. Throws FileError (path, member, value).
VDVR_API Phantom read_phantom(const std::filesystem::path& path);
/// The trilinear interpolation of a volume, zero outside its closed box; line integrals exact to rounding,
/// cell by cell. The rotation axis is x = y = 0 of the volume's world coordinates. Cost per view: columns *
/// (nx + ny) * nz. Memory: one reordered copy of the samples. Throws InputError (fewer than 2 samples on an
/// axis, sizes that do not match).
VDVR_API Phantom volume_phantom(Volume volume);

/// A point source on a circle about the axis, and a flat detector opposite.
struct ConeSetup {
  double source_to_axis = 0, source_to_detector = 0;
  double detector_offset = 0;  ///< columns by which the detector is moved towards higher ones
  double in_plane_deg = 0, out_of_plane_deg = 0;  ///< tilts, as RTK's angles
  int sense = 1;                                  ///< -1: the other way round
  double focal_spot = 0;                          ///< side of a square source, along the detector's axes
  /// Points along each axis of a pixel, and of the source where it has a side, whose mean is taken (midpoints
  /// of equal parts).
  int supersampling = 1;
};

struct SimulateOptions {
  int angles = 180;
  double arc_deg = 180;  ///< angles k * arc / angles
  std::int64_t columns = 129, rows = 129;
  double pitch_u = 1, pitch_v = 1;
  double detector_offset =
      0;  ///< of parallel beam, columns by which the detector is moved towards higher ones
  std::string unit = "pixel";
  bool band_limited =
      true;  ///< 16x finer line integrals in u, ideal low-pass at the detector's Nyquist, decimation
  double noise_sigma = 0;  ///< Gaussian, of the largest line integral, added on the (fine) detector
  std::uint64_t seed = 1;

  // Detector recipe, in this order after the noise. All lengths in fine pixels; edges are mirrored about the
  // last pixel's outer side. The fine detector has `binning` times the columns and rows at 1/binning of the
  // pitch.
  int median = 1;                         ///< side of a square median window, odd; 0 or 1: none
  double gaussian_u = 0, gaussian_v = 0;  ///< standard deviations of a Gaussian blur; 0: none
  /// Of parallel beam, by view how far the sample stands towards higher columns and rows, in `unit`; empty:
  /// it only turns.
  std::vector<std::array<double, 2>> shifts{};
  /// Of parallel beam: the axis' roll in the detector's plane, as ParallelGeometry has it. The detector's
  /// middle is where its columns are counted from, `detector_offset` columns beside the axis, across it.
  double axis_roll_deg = 0;
  std::optional<ConeSetup> cone;  ///< pitches are then those on the detector

  int binning = 1;  ///< fine pixels per detector pixel, both ways; their mean is the pixel

  std::uint64_t max_memory_bytes = 0;  ///< 0: no limit
  std::filesystem::path scratch;       ///< as ScanOptions::scratch
};

/// Shifts of so many views from a text file: a number a view, or two (columns, rows). Throws FileError.
VDVR_API std::vector<std::array<double, 2>> read_shifts(const std::filesystem::path& path,
                                                        std::int64_t views);

/// Views at k * arc / angles. Cost: angles * rows * columns (* binning^2, * 16 band-limited, *
/// supersampling^2, or ^4 with a focal spot) line integrals
/// over all cores, twice with noise (its size needs the largest integral first), plus for the low-pass nine
/// transforms of two to six times the columns for every two rows. Memory: the result, in a scratch file where
/// it takes more than an eighth of the limit, and per core about one fine view in double. The same
/// options give the same noise on any number of cores. Progress is called from the calling thread only and
/// may throw. Throws InputError, ResourceError.
VDVR_API ProjectionSet simulate(const Phantom& phantom, const SimulateOptions& options,
                                const Progress& progress = {});

/// A folder that read_scan() reads: projections.h5, of line integrals or of counted photons, and scan.json
/// with the geometry that `options` say. The folder must exist. Throws FileError.
VDVR_API void write_cone_scan(const std::filesystem::path& folder, const ProjectionSet& scan,
                              const SimulateOptions& options, const std::optional<PhotonCounts>& counts = {});

}  // namespace vdvr
