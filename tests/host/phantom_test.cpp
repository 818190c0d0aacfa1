#define BOOST_TEST_MODULE phantom
#include <boost/test/unit_test.hpp>

#include <unistd.h>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "tests/reference/line_integral.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/simulate.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;
const std::vector<double> angles{0, 0.3, pi / 4, 1.1, pi / 2, 2.0, 3.0, 4.4};

void check_close(double value, double expected, double tolerance) {
  BOOST_TEST(std::abs(value - expected) <= tolerance,
             value << " against " << expected << ", tolerance " << tolerance);
}

// What a phantom's line integral must be: its own density, summed along the ray.
double summed(const Phantom& p, double theta, double u, double v, double reach, int steps) {
  return reference::midpoint([&](double s) { return p.density(reference::on_ray(theta, u, v, s)); }, -reach,
                             reach, steps);
}

double total_density(const Phantom& p) {
  double sum = 0;
  for (const Ellipsoid& e : p.ellipsoids) sum += std::abs(e.density);
  return sum;
}

void check_views_equal_rays(const Phantom& p, double theta, const std::vector<double>& u,
                            const std::vector<double>& v, double magnitude) {
  std::vector<double> out(u.size() * v.size(), std::nan(""));
  p.view_integrals(theta, u, v, out);
  for (std::size_t j = 0; j < v.size(); ++j)
    for (std::size_t i = 0; i < u.size(); ++i)
      check_close(out[j * u.size() + i], p.line_integral(theta, u[i], v[j]),
                  tolerance::fp64_sum(8, magnitude));
}

Volume make_volume(Index3 cells, const std::function<double(double, double, double)>& f) {
  Volume volume;
  volume.grid = {cells, {-1.5, -2.25, -0.75}, {0.25, 0.5, 0.375}, "mm"};
  const Index3 n = volume.grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const Vec3 p = volume.grid.position({x, y, z});
        volume.samples.push_back(static_cast<float>(f(p[0], p[1], p[2])));
      }
  return volume;
}

std::pair<double, double> inside_volume(const Grid& g, double theta, double u) {
  return reference::inside(theta, u, g.origin[0],
                           g.origin[0] + static_cast<double>(g.cells[0]) * g.spacing[0], g.origin[1],
                           g.origin[1] + static_cast<double>(g.cells[1]) * g.spacing[1]);
}

class JsonFile {
 public:
  explicit JsonFile(const std::string& text)
      : path_(std::filesystem::temp_directory_path() /
              ("vdvr_phantom_test_" + std::to_string(::getpid()) + ".json")) {
    std::ofstream(path_) << text;
  }
  ~JsonFile() { std::filesystem::remove(path_); }
  JsonFile(const JsonFile&) = delete;
  JsonFile& operator=(const JsonFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void check_refused(const std::string& text, const std::string& says) {
  const JsonFile file(text);
  try {
    read_phantom(file.path());
    BOOST_ERROR("accepted: " << text);
  } catch (const FileError& e) {
    const std::string message = e.what();
    BOOST_TEST(message.find(says) != std::string::npos, message);
    BOOST_TEST(message.find(file.path().string()) != std::string::npos, message);
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(sphere_chords_are_those_of_a_circle) {
  const Phantom p = sphere(2.5, 3);
  for (const double theta : angles)
    for (const double u : {0.0, 1.0, -2.0, 2.4})
      for (const double v : {0.0, 0.5, -1.25}) {
        const double rest = 2.5 * 2.5 - u * u - v * v;
        check_close(p.line_integral(theta, u, v), rest > 0 ? 3 * 2 * std::sqrt(rest) : 0,
                    tolerance::fp64_sum(16, 3 * 2 * 2.5 * 2.5 / std::sqrt(std::max(rest, 0.01))));
      }
  BOOST_TEST(p.line_integral(0, 2.6, 0) == 0.0);
  BOOST_TEST(p.line_integral(0, 0, -2.6) == 0.0);
}

BOOST_AUTO_TEST_CASE(rotated_ellipsoids_integrate_their_own_density) {
  const Phantom p = ellipsoid_list(
      {{2, {0.5, -0.25, 0.1}, {1, 2, 1.5}, 30}, {-0.5, {0, 0.5, 0}, {0.2, 0.7, 0.4}, -75}}, 0, "two");
  constexpr int steps = 20000;
  constexpr double reach = 4;
  for (const double theta : angles)
    for (const double u : {-1.3, -0.4, 0.05, 0.9, 1.9})
      for (const double v : {-0.3, 0.0, 1.2})
        check_close(p.line_integral(theta, u, v), summed(p, theta, u, v, reach, steps),
                    2 * reach / steps * total_density(p));
}

BOOST_AUTO_TEST_CASE(phi_turns_an_ellipsoid_counterclockwise_about_z) {
  const Phantom p = ellipsoid_list({{1, {0, 0, 0}, {2, 0.5, 1}, 90}}, 0, "turned");
  BOOST_TEST(p.density({0, 1.9, 0}) == 1.0);
  BOOST_TEST(p.density({1.9, 0, 0}) == 0.0);
  const Phantom q = ellipsoid_list({{1, {0, 0, 0}, {2, 0.5, 1}, 45}}, 0, "turned");
  BOOST_TEST(q.density({1.2, 1.2, 0}) == 1.0);
  BOOST_TEST(q.density({1.2, -1.2, 0}) == 0.0);
  // Seen at theta = 45 degrees the ray runs across the long axis: the chord through the middle is the short
  // one.
  check_close(q.line_integral(pi / 4, 0, 0), 1, tolerance::fp64_sum(16, 2));
}

BOOST_AUTO_TEST_CASE(shepp_logan_has_the_densities_of_its_table) {
  const Phantom p = shepp_logan(64);
  const auto at = [&](double x, double y, double z) { return p.density({64 * x, 64 * y, 64 * z}); };
  const double tol = tolerance::fp64_sum(12, 4);
  BOOST_TEST(p.ellipsoids.size() == 12u);
  check_close(at(0, .9, 0), 1, tol);            // skull
  check_close(at(0, -.3, 0), .2, tol);          // brain
  check_close(at(.22, 0, 0), 0, tol);           // right ventricle
  check_close(at(-.22, 0, 0), 0, tol);          // left ventricle
  check_close(at(0, .5, -.15), .3, tol);        // upper ellipsoid
  check_close(at(.0078125, -.1, 0), .4, tol);   // thick tumour
  check_close(at(-.0703125, .08, 0), .4, tol);  // thin tumours
  check_close(at(.0078125, .08, 0), .4, tol);
  check_close(at(.0859375, .08, 0), .4, tol);
  check_close(at(-.08, -.605, 0), .3, tol);
  check_close(at(0, -.606, 0), .3, tol);
  check_close(at(.06, -.605, 0), .3, tol);
  BOOST_TEST(at(0, .93, 0) == 0.0);
  BOOST_TEST(at(0, 0, .82) == 0.0);
  // The ventricles lean outwards at the top: -18 degrees turns the right one clockwise.
  check_close(at(.22 + .2 * std::sin(pi / 10), .2 * std::cos(pi / 10), 0), 0, tol);
}

BOOST_AUTO_TEST_CASE(mass_of_a_projected_row_is_the_mass_of_the_slice_at_every_angle) {
  const Phantom p = shepp_logan(1);
  constexpr int n = 20001;
  const double width = 2.4, h = width / n;
  std::vector<double> u;
  for (int i = 0; i < n; ++i) u.push_back(-width / 2 + (i + 0.5) * h);
  for (const double v : {0.0, 0.04, -0.3}) {
    double mass = 0, variation = 0;
    for (const Ellipsoid& e : p.ellipsoids) {
      const double z = (v - e.center[2]) / e.semi_axes[2], w2 = std::max(0.0, 1 - z * z);
      mass += e.density * pi * e.semi_axes[0] * e.semi_axes[1] * w2;
      // A shadow rises to its longest chord and falls again.
      variation += 2 * std::abs(e.density) * 2 * std::max(e.semi_axes[0], e.semi_axes[1]);
    }
    for (const double theta : angles) {
      std::vector<double> row(u.size());
      p.view_integrals(theta, u, std::span(&v, 1), row);
      double sum = 0;
      for (const double value : row) sum += value;
      check_close(sum * h, mass, h * variation);  // the midpoint rule errs by at most h times the variation
    }
  }
}

BOOST_AUTO_TEST_CASE(views_of_ellipsoids_equal_their_rays) {
  check_views_equal_rays(shepp_logan(64), 0.7, {-50, -10.5, 0, 3.25, 60}, {-40, 0, 1.5, 60}, 256);
}

BOOST_AUTO_TEST_CASE(marschner_lobb_is_the_published_function) {
  const Phantom p = marschner_lobb(20);
  const double r = std::hypot(0.3, 0.4);
  const double f =
      (1 - std::sin(pi * 0.25 / 2) + 0.25 * (1 + std::cos(2 * pi * 6 * std::cos(pi * r / 2)))) / 2.5;
  check_close(p.density({6, -8, 5}), f, tolerance::fp64_sum(64, 1));
  BOOST_TEST(p.density({20.1, 0, 0}) == 0.0);
  BOOST_TEST(p.density({0, -20.1, 0}) == 0.0);
  BOOST_TEST(p.density({0, 0, 33}) != 0.0);  // not cut in z
}

BOOST_AUTO_TEST_CASE(marschner_lobb_quadrature_is_at_rounding) {
  constexpr double side = 3;
  const Phantom p = marschner_lobb(side);
  double furthest = 0;
  for (const double theta : angles)
    for (int i = -20; i <= 20; ++i)
      for (const double v : {-3.7, 0.0, 1.1}) {
        const double u = i * 0.2071 * side / 3;
        const auto [a, b] = reference::inside(theta, u, -side, side, -side, side);
        const auto along = [&](double s) {
          const auto q = reference::on_ray(theta, u, v, s);
          const double r = std::hypot(q[0], q[1]) / side;
          return (1 - std::sin(pi * q[2] / side / 2) +
                  0.25 * (1 + std::cos(12 * pi * std::cos(pi * r / 2)))) /
                 2.5;
        };
        const double once = reference::gauss5(along, a, b, 200), twice = reference::gauss5(along, a, b, 400);
        const double tol = tolerance::fp64_sum(2000, b - a) + tolerance::fp64_sum(8, 12 * pi * side);
        check_close(once, twice, tol);  // the reference itself has converged
        check_close(p.line_integral(theta, u, v), twice, tol);
        furthest = std::max(furthest, std::abs(p.line_integral(theta, u, v) - twice));
      }
  BOOST_TEST_MESSAGE("largest difference to the reference: " << furthest);
  check_views_equal_rays(p, 0.7, {-4, -1, 0, 2.9}, {-1, 0, 7}, 4 * side);
}

BOOST_AUTO_TEST_CASE(constant_volume_gives_chord_lengths_of_its_box) {
  const Volume volume = make_volume({13, 9, 5}, [](double, double, double) { return 1.5; });
  const Grid grid = volume.grid;
  const Phantom p = volume_phantom(volume);
  for (const double theta : angles)
    for (const double u : {-2.01, -1.1, -0.37, 0.01, 0.13, 0.8, 2.2, 9.0}) {
      const auto [a, b] = inside_volume(grid, theta, u);
      check_close(p.line_integral(theta, u, 0.2), 1.5 * (b - a), tolerance::fp64_sum(64, 1.5 * 16));
    }
  BOOST_TEST(p.line_integral(0.3, 0.1, -0.76) == 0.0);  // above and below the box
  BOOST_TEST(p.line_integral(0.3, 0.1, 1.13) == 0.0);
}

BOOST_AUTO_TEST_CASE(linear_volume_is_integrated_exactly) {
  const auto f = [](double x, double y, double z) {
    return 1 + 2 * x - 3 * y + 0.5 * z;
  };  // exact in fp32 at the samples
  const Volume volume = make_volume({13, 9, 5}, f);
  const Grid grid = volume.grid;
  const Phantom p = volume_phantom(volume);
  for (const double theta : angles)
    for (const double u : {-2.01, -1.1, -0.37, 0.13, 0.8, 2.2})
      for (const double v : {-0.75, -0.2, 0.3, 1.125}) {
        const auto [a, b] = inside_volume(grid, theta, u);
        const auto middle = reference::on_ray(theta, u, v, (a + b) / 2);
        check_close(p.line_integral(theta, u, v), (b - a) * f(middle[0], middle[1], middle[2]),
                    tolerance::fp64_sum(64, 16 * 12));
      }
}

BOOST_AUTO_TEST_CASE(any_volume_integrates_its_trilinear_interpolation) {
  std::mt19937 random(7);
  const Volume volume = make_volume(
      {13, 9, 5}, [&](double, double, double) { return static_cast<double>(random()) * 0x1p-32; });
  const Grid g = volume.grid;
  const Phantom p = volume_phantom(volume);
  std::vector<double> xs, ys;
  for (std::int64_t i = 0; i <= g.cells[0]; ++i) xs.push_back(g.position({i, 0, 0})[0]);
  for (std::int64_t i = 0; i <= g.cells[1]; ++i) ys.push_back(g.position({0, i, 0})[1]);
  for (const double theta : angles)
    for (const double u : {-1.1, -0.37, 0.13, 0.8, 1.37})
      for (const double v : {-0.6, 0.3}) {
        const auto s = reference::crossings(theta, u, xs, ys);
        double sum = 0;
        for (std::size_t i = 0; i + 1 < s.size(); ++i)  // quadratic between crossings
          sum += reference::gauss5([&](double at) { return p.density(reference::on_ray(theta, u, v, at)); },
                                   s[i], s[i + 1], 1);
        check_close(p.line_integral(theta, u, v), sum, tolerance::fp64_sum(1000, 16));
      }
  check_views_equal_rays(p, 0.7, {-1, 0, 0.5, 9}, {-0.75, -0.7, 0, 0.9, 2}, 16);
}

BOOST_AUTO_TEST_CASE(volume_density_is_the_samples_at_the_samples) {
  const Volume volume =
      make_volume({3, 4, 5}, [](double x, double y, double z) { return x * y + z * z * x; });
  const Phantom p = volume_phantom(volume);
  std::size_t index = 0;
  for (std::int64_t z = 0; z <= 5; ++z)
    for (std::int64_t y = 0; y <= 4; ++y)
      for (std::int64_t x = 0; x <= 3; ++x)
        BOOST_TEST(p.density(volume.grid.position({x, y, z})) ==
                   static_cast<double>(volume.samples[index++]));
  BOOST_TEST(p.density({-1.51, 0, 0}) == 0.0);
}

BOOST_AUTO_TEST_CASE(unusable_volumes_are_refused) {
  Volume flat = make_volume({3, 4, 0}, [](double, double, double) { return 1; });
  BOOST_CHECK_THROW(volume_phantom(flat), InputError);
  Volume wrong = make_volume({3, 4, 5}, [](double, double, double) { return 1; });
  wrong.samples.pop_back();
  BOOST_CHECK_THROW(volume_phantom(wrong), InputError);
  wrong.samples.push_back(std::nanf(""));
  BOOST_CHECK_THROW(volume_phantom(wrong), InputError);
}

BOOST_AUTO_TEST_CASE(json_phantom_equals_the_same_list) {
  const JsonFile file(
      R"({"ellipsoids": [{"density": 2, "center": [0.5, -1, 0.25], "semi_axes": [1, 2, 3], "phi_deg": 30},
                          {"density": -1, "center": [0, 0, 0], "semi_axes": [1, 1, 1]}], "background": 0})");
  const Phantom p = read_phantom(file.path());
  const Phantom q =
      ellipsoid_list({{2, {0.5, -1, 0.25}, {1, 2, 3}, 30}, {-1, {0, 0, 0}, {1, 1, 1}, 0}}, 0, "list");
  BOOST_TEST(p.ellipsoids.size() == 2u);
  BOOST_TEST(p.description == q.description);
  BOOST_TEST(p.name == file.path().filename().string());
  for (const double theta : angles)
    BOOST_TEST(p.line_integral(theta, 0.3, 0.2) == q.line_integral(theta, 0.3, 0.2));
}

BOOST_AUTO_TEST_CASE(faulty_json_is_refused_with_path_and_member) {
  const std::string good = R"("density": 1, "center": [0, 0, 0], "semi_axes": [1, 1, 1])";
  check_refused("{", "is not JSON");
  check_refused("[]", "not a JSON object");
  check_refused("{}", "'ellipsoids' must be a list");
  check_refused(R"({"ellipsoids": []})", "at least one");
  check_refused(R"({"ellipsoids": [{"density": 1, "center": [0, 0, 0]}]})",
                "'ellipsoids[0].semi_axes' must be a list of numbers");
  check_refused(R"({"ellipsoids": [{"density": "1", "center": [0, 0, 0], "semi_axes": [1, 1, 1]}]})",
                "'ellipsoids[0].density' must be a number");
  check_refused(R"({"ellipsoids": [{"density": 1, "center": [0, 0], "semi_axes": [1, 1, 1]}]})",
                "three numbers");
  check_refused(R"({"ellipsoids": [{"density": 1, "center": [0, 0, 0], "semi_axes": [1, 0, 1]}]})",
                "semi-axis 0");
  check_refused(R"({"ellipsoids": [{)" + good + R"(, "phi": 3}]})", "member 'ellipsoids[0].phi' is unknown");
  check_refused(R"({"ellipsoids": [{)" + good + R"(}], "background": 1e999})", "is not JSON");
  BOOST_CHECK_THROW(read_phantom("no/such/file.json"), FileError);
  BOOST_CHECK_THROW(read_phantom(std::filesystem::temp_directory_path()), FileError);
}

BOOST_AUTO_TEST_CASE(unusable_parameters_are_refused) {
  BOOST_CHECK_THROW(sphere(0), InputError);
  BOOST_CHECK_THROW(sphere(std::nan("")), InputError);
  BOOST_CHECK_THROW(marschner_lobb(-1), InputError);
  BOOST_CHECK_THROW(shepp_logan(0), InputError);
  BOOST_CHECK_THROW(ellipsoid_list({}, 0, "none"), InputError);
  BOOST_CHECK_THROW(ellipsoid_list({{}}, std::nan(""), "background"), InputError);
}

BOOST_AUTO_TEST_CASE(pores_of_a_foam_lie_in_its_body_and_do_not_touch) {
  const Phantom p = foam(40, 30, 300, 7);
  BOOST_TEST_REQUIRE(p.ellipsoids.size() == 301u);
  BOOST_TEST(p.description == foam(40, 30, 300, 7).description);
  BOOST_TEST(p.description != foam(40, 30, 300, 8).description);
  for (std::size_t i = 1; i < p.ellipsoids.size(); ++i) {
    const Ellipsoid& e = p.ellipsoids[i];
    BOOST_TEST((e.density == -1 && e.semi_axes[0] == e.semi_axes[1] && e.semi_axes[1] == e.semi_axes[2]));
    BOOST_TEST(std::abs(e.center[2]) + e.semi_axes[0] <= 30);
    BOOST_TEST(p.density(e.center) == 0);
    for (std::size_t j = 1; j < i; ++j) {
      const Vec3& a = e.center;
      const Vec3& b = p.ellipsoids[j].center;
      BOOST_TEST(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) >
                 e.semi_axes[0] + p.ellipsoids[j].semi_axes[0]);
    }
    // On its surface the body is still there: it touches no edge.
    const double out = 1.01 * e.semi_axes[0];
    BOOST_TEST(p.density({e.center[0] + out, e.center[1], e.center[2]}) == 1);
  }
  BOOST_CHECK_THROW(foam(40, 30, 0, 1), InputError);
  BOOST_CHECK_THROW(foam(1, 0.01, 5000, 1), InputError);
}
