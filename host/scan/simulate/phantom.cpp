// Ellipsoid phantoms: closed-form chords, the modified Shepp-Logan head, and the JSON form. Densities add.
//
// An ellipsoid with semi-axes a, b, c turned by phi about z is seen at theta as the ellipse at theta - phi.
// With A^2 = a^2 cos^2 + b^2 sin^2, w^2 = 1 - ((v - z0)/c)^2 and t the ray's distance from the centre's
// projection, the chord is 2 a b sqrt(A^2 w^2 - t^2) / A^2 (Kak and Slaney, Principles of Computerized
// Tomographic Imaging, section 3.1; each slice of an ellipsoid is an ellipse with semi-axes a w and b w).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/base/system/casts.hpp"
#include "host/scan/geometry/description.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr {
namespace {

using nlohmann::json;

// An ellipsoid seen from one direction.
struct Shadow {
  double t0;      // where its centre falls on the detector
  double half2;   // A^2: the square of the shadow's half width in the middle slice
  double factor;  // density * 2 a b / A^2

  Shadow(const Ellipsoid& e, double theta)
      : t0(e.center[0] * std::cos(theta) + e.center[1] * std::sin(theta)) {
    const double c = e.semi_axes[0] * std::cos(theta - e.phi_deg * radians_per_degree);
    const double s = e.semi_axes[1] * std::sin(theta - e.phi_deg * radians_per_degree);
    half2 = c * c + s * s;
    factor = e.density * 2 * e.semi_axes[0] * e.semi_axes[1] / half2;
  }
};

// A^2 w^2: what t^2 must stay below in the slice at v; negative beside the ellipsoid.
double slice_half2(const Ellipsoid& e, const Shadow& shadow, double v) {
  const double h = (v - e.center[2]) / e.semi_axes[2];
  return shadow.half2 * (1 - h * h);
}

void add_view(const Ellipsoid& e, double theta, std::span<const double> u, std::span<const double> v,
              std::span<double> out) {
  const Shadow shadow(e, theta);
  for (std::size_t j = 0; j < v.size(); ++j) {
    const double limit = slice_half2(e, shadow, v[j]);
    if (!(limit > 0)) continue;
    double* row = out.data() + j * u.size();
    for (std::size_t i = 0; i < u.size(); ++i) {
      const double t = u[i] - shadow.t0, rest = limit - t * t;
      if (rest > 0) row[i] += shadow.factor * std::sqrt(rest);
    }
  }
}

double chord(const Ellipsoid& e, double theta, double u, double v) {
  double value = 0;
  add_view(e, theta, std::span(&u, 1), std::span(&v, 1), std::span(&value, 1));
  return value;
}

// Turned about z as its first two axes are; sine and cosine once, not at every ray and every point.
class TurnedEllipsoid {
 public:
  explicit TurnedEllipsoid(const Ellipsoid& e)
      : e_(e), c_(std::cos(e.phi_deg * radians_per_degree)), s_(std::sin(e.phi_deg * radians_per_degree)) {}

  [[nodiscard]] double chord_of_line(const Vec3& point, const Vec3& direction) const;
  [[nodiscard]] bool contains(const Vec3& point) const;
  [[nodiscard]] double density() const { return e_.density; }

 private:
  // A vector from its centre, in coordinates in which it is the unit ball.
  [[nodiscard]] Vec3 in_ball(const Vec3& v) const {
    return {(v[0] * c_ + v[1] * s_) / e_.semi_axes[0], (v[1] * c_ - v[0] * s_) / e_.semi_axes[1],
            v[2] / e_.semi_axes[2]};
  }
  [[nodiscard]] Vec3 from_centre(const Vec3& p) const {
    return {p[0] - e_.center[0], p[1] - e_.center[1], p[2] - e_.center[2]};
  }

  Ellipsoid e_;
  double c_, s_;
};

double product(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Of a whole line: its part within the unit ball is between the roots of |p + s d|^2 = 1.
double TurnedEllipsoid::chord_of_line(const Vec3& point, const Vec3& direction) const {
  const Vec3 p = in_ball(from_centre(point)), d = in_ball(direction);
  // From the point of the line nearest to the centre: a far source costs no digits.
  const double along = product(d, d), to_middle = product(p, d) / along;
  const Vec3 middle{p[0] - to_middle * d[0], p[1] - to_middle * d[1], p[2] - to_middle * d[2]};
  const double rest = 1 - product(middle, middle);
  return rest > 0 ? 2 * e_.density * std::sqrt(rest / along) : 0;
}

bool TurnedEllipsoid::contains(const Vec3& point) const {
  const Vec3 p = in_ball(from_centre(point));
  return product(p, p) <= 1;
}

void check(const Ellipsoid& e, std::size_t index) {
  const auto refuse = [&](const char* what, double value) {
    throw InputError(
        fmt::format("ellipsoid {}: {} {} is not usable; densities, centres and angles must be finite, "
                    "semi-axes finite and positive",
                    index, what, value));
  };
  if (!std::isfinite(e.density)) refuse("density", e.density);
  if (!std::isfinite(e.phi_deg)) refuse("phi_deg", e.phi_deg);
  for (const double c : e.center)
    if (!std::isfinite(c)) refuse("centre", c);
  for (const double a : e.semi_axes)
    if (!std::isfinite(a) || !(a > 0)) refuse("semi-axis", a);
}

json to_json(const std::vector<Ellipsoid>& ellipsoids, double background) {
  json list = json::array();
  for (const Ellipsoid& e : ellipsoids)
    list.push_back(
        {{"density", e.density}, {"center", e.center}, {"semi_axes", e.semi_axes}, {"phi_deg", e.phi_deg}});
  return {{"ellipsoids", list}, {"background", background}};
}

}  // namespace

Phantom ellipsoid_list(std::vector<Ellipsoid> ellipsoids, double background, std::string name) {
  if (ellipsoids.empty()) throw InputError("the list of ellipsoids is empty; give at least one");
  if (!std::isfinite(background)) throw InputError(fmt::format("background {} is not finite", background));
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) check(ellipsoids[i], i);

  const std::vector<TurnedEllipsoid> turned(ellipsoids.begin(), ellipsoids.end());
  Phantom p;
  p.name = std::move(name);
  p.background = background;
  p.description = to_json(ellipsoids, background).dump();
  p.density = [turned, background](const Vec3& point) {
    double sum = background;
    for (const TurnedEllipsoid& e : turned)
      if (e.contains(point)) sum += e.density();
    return sum;
  };
  // The constant's own integral over an endless line is infinite, never silently left out.
  p.line_integral = [ellipsoids, background](double theta, double u, double v) {
    double sum = background == 0 ? 0 : std::copysign(std::numeric_limits<double>::infinity(), background);
    for (const Ellipsoid& e : ellipsoids) sum += chord(e, theta, u, v);
    return sum;
  };
  p.view_integrals = [ellipsoids, background](double theta, std::span<const double> u,
                                              std::span<const double> v, std::span<double> out) {
    const double start =
        background == 0 ? 0 : std::copysign(std::numeric_limits<double>::infinity(), background);
    std::fill(out.begin(), out.end(), start);
    for (const Ellipsoid& e : ellipsoids) add_view(e, theta, u, v, out);
  };
  p.ray_integral = [turned, background](const Vec3& point, const Vec3& direction) {
    double sum = background == 0 ? 0 : std::copysign(std::numeric_limits<double>::infinity(), background);
    for (const TurnedEllipsoid& e : turned) sum += e.chord_of_line(point, direction);
    return sum;
  };
  p.ellipsoids = std::move(ellipsoids);
  return p;
}

Phantom sphere(double radius, double density) {
  return ellipsoid_list({{density, {0, 0, 0}, {radius, radius, radius}, 0}}, 0, "sphere");
}

Phantom shepp_logan(double unit) {
  // After Shepp and Logan (1974), contrasts as modified by Toft, in three dimensions; the three thin tumours
  // above the thick one of the same density are those of the paper's Fig. 10.
  std::vector<Ellipsoid> list{
      {1, {0, 0, 0}, {.69, .92, .81}, 0},
      {-.8, {0, -.0184, 0}, {.6624, .874, .78}, 0},
      {-.2, {.22, 0, 0}, {.11, .31, .22}, -18},
      {-.2, {-.22, 0, 0}, {.16, .41, .28}, 18},
      {.1, {0, .35, -.15}, {.21, .25, .41}, 0},
      {.2, {.0078125, -.1, 0}, {.046, .046, .05}, 0},  // thick tumour
      {.2, {-.0703125, .08, 0}, {.012, .07, .1}, 0},   // thin tumours
      {.2, {.0078125, .08, 0}, {.012, .07, .1}, 0},
      {.2, {.0859375, .08, 0}, {.012, .07, .1}, 0},
      {.1, {-.08, -.605, 0}, {.046, .023, .05}, 0},  // three small ones below
      {.1, {0, -.606, 0}, {.023, .023, .02}, 0},
      {.1, {.06, -.605, 0}, {.023, .046, .05}, 0},
  };
  for (Ellipsoid& e : list)
    for (std::size_t a = 0; a < 3; ++a) {
      e.center[a] *= unit;
      e.semi_axes[a] *= unit;
    }
  return ellipsoid_list(std::move(list), 0, "shepp-logan");
}

Phantom read_phantom(const std::filesystem::path& path) {
  const io::Description file(path, {"ellipsoids", "background", "name", "comment"});
  std::vector<Ellipsoid> ellipsoids;
  for (const io::Description& e :
       file.members("ellipsoids", {"density", "center", "semi_axes", "phi_deg", "comment"}))
    ellipsoids.push_back(
        {e.number("density"), e.vec3("center"), e.vec3("semi_axes"), e.number_or("phi_deg", 0)});
  try {
    return ellipsoid_list(std::move(ellipsoids), file.number_or("background", 0), path.filename().string());
  } catch (const InputError& e) {
    file.fail(e.what());
  }
}

}  // namespace vdvr
