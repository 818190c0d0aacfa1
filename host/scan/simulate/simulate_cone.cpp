// Cone-beam rays through phantoms, and the folder that holds such a scan.
#include "host/scan/simulate/simulate_cone.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/base/system/casts.hpp"
#include "host/scan/simulate/simulate_band_limit.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr {
namespace {

// The view at k * arc / angles; pixels are the detector's own.
CircularView circular_view_of(const SimulateOptions& o, int k) {
  const ConeSetup& cone = *o.cone;
  CircularView view;
  view.theta_rad = cone.sense * (k * o.arc_deg / o.angles * radians_per_degree);
  view.source_to_axis = cone.source_to_axis;
  view.source_to_detector = cone.source_to_detector;
  view.pitch_u = o.pitch_u;
  view.pitch_v = o.pitch_v;
  view.center = 0.5 * static_cast<double>(o.columns - 1) - cone.detector_offset;
  view.row = 0.5 * static_cast<double>(o.rows - 1);
  view.in_plane_rad = cone.in_plane_deg * radians_per_degree;
  view.out_of_plane_rad = cone.out_of_plane_deg * radians_per_degree;
  return view;
}

// Midpoints of `n` equal parts of -width/2 .. width/2.
std::vector<double> midpoints(double width, int n) {
  std::vector<double> out(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) out[static_cast<std::size_t>(i)] = width * ((i + 0.5) / n - 0.5);
  return out;
}

}  // namespace

void check_cone(const Phantom& phantom, const ConeSetup& cone) {
  if (!phantom.ray_integral)
    throw InputError(fmt::format(
        "simulate: phantom \"{}\" has no integrals along slanted rays; take a volume, ellipsoids or a sphere",
        phantom.name));
  if (!(cone.source_to_axis > 0 && cone.source_to_detector > 0 && std::isfinite(cone.source_to_axis) &&
        std::isfinite(cone.source_to_detector)))
    throw InputError(
        fmt::format("simulate: cone {},{} is not usable; give the distances from the source to the "
                    "axis and to the detector, above 0",
                    cone.source_to_axis, cone.source_to_detector));
  for (const double angle : {cone.in_plane_deg, cone.out_of_plane_deg})
    if (!(std::abs(angle) < 90))
      throw InputError(fmt::format("simulate: tilt {} is not usable; give degrees below 90", angle));
  if (!std::isfinite(cone.detector_offset) || !(cone.focal_spot >= 0) || !std::isfinite(cone.focal_spot))
    throw InputError("simulate: the detector's offset and the focal spot must be finite");
  if (cone.sense != 1 && cone.sense != -1)
    throw InputError(fmt::format("simulate: sense {} is not usable; give 1 or -1", cone.sense));
  if (cone.supersampling < 1 || cone.supersampling > 16)
    throw InputError(
        fmt::format("simulate: supersampling {} is not usable; give 1 to 16", cone.supersampling));
}

ConeGeometry cone_geometry_of(const SimulateOptions& o) {
  ConeGeometry cone;
  for (int k = 0; k < o.angles; ++k) cone.views.push_back(circular_view(circular_view_of(o, k)));
  cone.redundancy = natural_redundancy(cone, o.columns);
  return cone;
}

ConeRays::ConeRays(const Phantom& phantom, const SimulateOptions& o, int k)
    : phantom_(phantom), view_(cone_view(circular_view(circular_view_of(o, k)))), options_(o) {
  const int n = o.cone->supersampling;
  const double part = 1.0 / (o.binning * (o.band_limited ? static_cast<double>(BandLimiter::rate) : 1.0));
  across_ = midpoints(part, n);
  along_ = midpoints(1.0 / o.binning, n);
  spot_ = midpoints(o.cone->focal_spot, o.cone->focal_spot > 0 ? n : 1);
}

double ConeRays::operator()(double u, double v) const {
  const double column = u / options_.pitch_u + 0.5 * static_cast<double>(options_.columns - 1),
               row = v / options_.pitch_v + 0.5 * static_cast<double>(options_.rows - 1);
  double sum = 0;
  for (const double a : across_)
    for (const double b : along_) sum += through(column + a, row + b);
  return sum / static_cast<double>(across_.size() * along_.size());
}

double ConeRays::through(double column, double row) const {
  const Vec3 ray = view_.ray(column, row);
  if (spot_.size() == 1) return phantom_.ray_integral(view_.source, ray);
  // The pixel itself: how far along the ray the detector is.
  const double facing = ray[0] * view_.normal[0] + ray[1] * view_.normal[1] + ray[2] * view_.normal[2];
  const double far = options_.cone->source_to_detector / facing;
  double sum = 0;
  for (const double s : spot_)
    for (const double t : spot_) {
      Vec3 from{}, to{};
      double squared = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double moved = s * view_.along_u[a] + t * view_.along_v[a];
        from[a] = view_.source[a] + moved;
        to[a] = far * ray[a] - moved;
        squared += to[a] * to[a];
      }
      for (double& x : to) x /= std::sqrt(squared);
      sum += phantom_.ray_integral(from, to);
    }
  return sum / static_cast<double>(spot_.size() * spot_.size());
}

void write_cone_scan(const std::filesystem::path& folder, const ProjectionSet& scan,
                     const SimulateOptions& options, const std::optional<PhotonCounts>& counts) {
  if (!options.cone || !scan.cone)
    throw InputError(folder.string() + ": only a cone-beam scan is written as a folder");
  if (counts) write_photon_counts(folder / "projections.h5", scan, *counts);
  else write_data_exchange(folder / "projections.h5", scan);
  const ConeSetup& cone = *options.cone;
  const CircularView view = circular_view_of(options, 0);
  nlohmann::ordered_json geometry{{"source_to_axis", cone.source_to_axis},
                                  {"source_to_detector", cone.source_to_detector},
                                  {"pitch", {options.pitch_u, options.pitch_v}},
                                  {"center", view.center},
                                  {"row", view.row}};
  // Degrees as they were given: those of the HDF5 file have passed through radians.
  std::vector<double> angles;
  angles.reserve(static_cast<std::size_t>(options.angles));
  for (int k = 0; k < options.angles; ++k) angles.push_back(k * options.arc_deg / options.angles);
  geometry["angles"] = angles;
  if (cone.in_plane_deg != 0 || cone.out_of_plane_deg != 0)
    geometry["tilt"] = {cone.in_plane_deg, cone.out_of_plane_deg};
  geometry["sense"] = cone.sense;
  const nlohmann::ordered_json text{
      {"hdf5", "projections.h5"}, {"geometry", geometry}, {"unit", options.unit}};
  io::write_file(folder / "scan.json", text.dump(1) + "\n");
}

}  // namespace vdvr
