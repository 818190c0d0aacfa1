// Iso-surfaces of random trilinear fields against the first root in double precision.
#define BOOST_TEST_MODULE raycast_iso
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <cstring>

#include "host/picture/render/raycast.hpp"
#include "host/volume/sampler/resident_volume.hpp"
#include "tests/reference/first_root.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/rendering.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::u;

namespace {

RenderOptions surface_at(const Camera& camera, double value, std::int64_t size = 33) {
  RenderOptions o;
  o.mode = RenderMode::iso;
  o.width = o.height = size;
  o.camera = camera;
  o.surfaces = {{value}};
  o.shading = false;
  o.sampler = SamplerKind::buffer;
  return o;
}

/// Samples uniform in [-1, 1].
MixedVolume random_volume(const Index3& cells, unsigned seed) {
  return support::random_mixed(centred_grid(cells), 4, 1, {{0, 0, 0}}, seed);
}

struct Judgement {
  int hits = 0, misses = 0, wrong = 0;
};

/// Every ray must have a depth that is the first root of a value within what fp32 knows of the field, and the
/// sampler adds.
void judge(const MixedVolume& v, const RenderOptions& o, Judgement& result, double sampler = 0) {
  const ResidentVolume resident(device(), v);
  const auto pixels = raycast_float(device(), resident, o).pixels;
  double size = 0;
  for (std::size_t a = 0; a < 3; ++a)
    size = std::max(size, std::abs(o.camera.position[a]) + static_cast<double>(v.grid.cells[a]));
  // Positions: a handful of operations on coordinates of `size`. Values: 14 u of interpolation, twice, and
  // positions through gradients of at most 2 per sample on three axes.
  const double position = 8 * u * size, chord = std::sqrt(3.0) * 0x1p-20;
  const double value = sampler + 2 * 14 * u + 3 * 2 * v.rate * position;
  for (std::int64_t y = 0; y < o.height; ++y)
    for (std::int64_t x = 0; x < o.width; ++x) {
      const auto ray = reference::pixel_ray(o.camera, o.width, o.height, x, y);
      const auto low = reference::first_root(v, ray, o.surfaces[0].value - value);
      const auto high = reference::first_root(v, ray, o.surfaces[0].value + value);
      // Rays that miss the box within rounding, or start on the surface, have no answer.
      const auto [in, out] = reference::clip(ray, v.grid);
      if (std::abs(out - in) < 2 * position || std::abs(low.start - o.surfaces[0].value) <= 2 * value)
        continue;
      const double first = std::min(low.t, high.t), last = std::max(low.t, high.t);
      const float depth = pixels[static_cast<std::size_t>(o.width * y + x)].s[3];
      const double t = depth < 0 ? reference::kNoRoot : static_cast<double>(depth);
      ++(depth < 0 ? result.misses : result.hits);
      if (!(t >= first - position - chord && t <= last + position + chord)) ++result.wrong;
    }
}

Camera looking(const Vec3& from, const Vec3& at, double angle) {
  return look_at(from, at, std::nullopt, angle);
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_first_root_of_random_cells_is_found_on_every_ray) {
  Judgement j;
  for (const unsigned seed : {1u, 2u, 3u})
    for (const double value : {-0.4, 0.2, 0.8}) {
      const MixedVolume v = random_volume({9, 7, 11}, seed);
      judge(v, surface_at(orbit_camera(v.grid, 37.0 * seed, 21, 1), value), j);
    }
  BOOST_TEST(j.hits > 1000);
  BOOST_TEST(j.misses > 1000);
  BOOST_TEST(j.wrong == 0);
}

BOOST_AUTO_TEST_CASE(volumes_of_one_cell_have_their_roots) {
  Judgement j;
  for (unsigned seed = 1; seed <= 24; ++seed) {
    const MixedVolume v = random_volume({1, 1, 1}, seed);
    judge(v, surface_at(orbit_camera(v.grid, 15.0 * seed, 7.0 * seed - 80, 1.5), 0.1), j);
  }
  BOOST_TEST(j.hits > 1000);
  BOOST_TEST(j.wrong == 0);
}

BOOST_AUTO_TEST_CASE(rays_along_faces_and_edges_have_their_roots) {
  Judgement j;
  const MixedVolume v = random_volume({8, 8, 8}, 5);
  // The middle column and row of an odd picture look straight down faces of cells and of bricks, the middle
  // pixel down an edge; diagonals pass through edges and corners.
  for (const Vec3& eye : {Vec3{0, 20, 0}, Vec3{1, -20, 2}, Vec3{20, -3, 0}, Vec3{2, 2, 25}, Vec3{20, 20, 0},
                          Vec3{20, 20, 20}, Vec3{-20, 20, -20}})
    for (const double value : {0.0, 0.7}) {
      const bool diagonal = std::abs(eye[0]) == std::abs(eye[1]);
      const Vec3 at = diagonal                 ? Vec3{0, 0, 0}
                      : eye[0] == 20           ? Vec3{0, eye[1], eye[2]}
                      : std::abs(eye[1]) == 20 ? Vec3{eye[0], 0, eye[2]}
                                               : Vec3{eye[0], eye[1], 0};
      judge(v, surface_at(looking(eye, at, 30), value), j);
    }
  BOOST_TEST(j.hits > 1000);
  BOOST_TEST(j.wrong == 0);
}

BOOST_AUTO_TEST_CASE(cameras_inside_the_volume_find_their_roots) {
  Judgement j;
  const MixedVolume v = random_volume({9, 7, 11}, 9);
  for (const Vec3& eye : {Vec3{0.3, -0.2, 0.1}, Vec3{0, 0, 0}, Vec3{-1.5, 0.5, 1.5}, Vec3{4, 3, 5}})
    judge(v, surface_at(looking(eye, {eye[0] - 1, eye[1] + 0.25, eye[2]}, 110), 0.6), j);
  BOOST_TEST(j.hits > 500);
  BOOST_TEST(j.wrong == 0);
}

BOOST_AUTO_TEST_CASE(roots_are_found_in_cells_of_every_level_and_at_jumps_between_them) {
  Judgement j;
  for (const LevelTriple& coarsening : {LevelTriple{0, 0, 0}, {2, 0, 1}}) {
    const MixedVolume v =
        support::random_mixed(centred_grid({10, 9, 8}), 4, 4,
                              {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 2, 0}, {2, 2, 2}}, 4, coarsening);
    for (const double value : {0.2, 0.85, 0.97})
      judge(v, surface_at(orbit_camera(v.grid, 37, 21, 1), value), j);
  }
  BOOST_TEST(j.hits > 500);
  BOOST_TEST(j.wrong == 0);
}

BOOST_AUTO_TEST_CASE(rays_along_the_longest_axis_end) {
  // 8192 cells, where positions are coarsest: cells must follow one another to the end.
  Judgement j;
  const MixedVolume v = random_volume({8192, 2, 2}, 12);
  for (const Vec3& eye : {Vec3{5000, 0.3, 0.2}, Vec3{-5000, 0, 0}, Vec3{4500, 1, 0}, Vec3{-4099, 0.5, -1}})
    for (const double value : {0.9, 0.99, 1.5})
      judge(v, surface_at(looking(eye, {0, 0, 0}, 0.01), value, 9), j);
  BOOST_TEST(j.hits > 100);
  BOOST_TEST(j.wrong == 0);
}

BOOST_AUTO_TEST_CASE(a_feature_thinner_than_any_step_is_seen) {
  // 0.03 cells across, seen with a step that would leap over the volume.
  MixedVolume v = as_mixed(fields::uniform(centred_grid({16, 16, 16}), [](double x, double y, double z) {
    return x == 1 && y == 1 && z == 1 ? 1.0 : 0.0;
  }));
  RenderOptions o = surface_at(looking({20, 30, 15}, {1, 1, 1}, 0.25), 0.97, 65);
  const ResidentVolume resident(device(), v);
  const auto fine = raycast_float(device(), resident, o).pixels;
  const auto hits = std::count_if(fine.begin(), fine.end(), [](const auto& p) { return p.s[3] >= 0; });
  BOOST_TEST(hits > 10);
  o.step = 64;
  const auto coarse = raycast_float(device(), resident, o).pixels;
  BOOST_TEST(std::memcmp(fine.data(), coarse.data(), fine.size() * sizeof(cl_float4)) == 0);
}

BOOST_AUTO_TEST_CASE(skipping_and_packets_change_no_bit_of_several_surfaces) {
  const MixedVolume v = support::sampled_mixed(
      centred_grid({30, 27, 33}), 4, 4, {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}}, 6,
      [](double x, double y, double z) { return 0.02 * x + 0.015 * y + std::sin(0.3 * z) / 4; });
  const ResidentVolume resident(device(), v);
  RenderOptions o = surface_at(orbit_camera(v.grid, 203, -30, 1.2), 0);
  o.surfaces = {{0.3, 0.4}, {0.6, 0.5}, {0.9, 0.7}};
  o.shading = true;
  const auto with = raycast_float(device(), resident, o);
  for (const int lanes : {1, 4, 16}) {
    const auto other = raycast_float(device(), resident, o, {8, 8, lanes});
    BOOST_TEST(std::memcmp(with.pixels.data(), other.pixels.data(), with.pixels.size() * sizeof(cl_float4)) ==
               0);
  }
  o.skip_empty = false;
  const auto without = raycast_float(device(), resident, o);
  BOOST_TEST(std::memcmp(with.pixels.data(), without.pixels.data(), with.pixels.size() * sizeof(cl_float4)) ==
             0);
  BOOST_TEST(with.samples < without.samples);
}

BOOST_AUTO_TEST_CASE(the_texture_unit_finds_the_same_roots_within_the_probe) {
  const MixedVolume v =
      support::random_mixed(centred_grid({10, 9, 8}), 4, 4, {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 2, 0}}, 4);
  const ResidentVolume resident(device(), v);
  if (!resident.has_image3d()) return;
  const SamplerProbe probe = probe_sampler(device());
  // Weights err by delta and by coordinates of the atlas, neighbours differ by 2 at most; the cubic's
  // coefficients take its corners up to seven times.
  const auto n = static_cast<double>(resident.impl().layout.longest());
  const double field = 3 * (probe.delta + 2 * n * u) * 2 + probe.constant_error;
  Judgement j;
  for (const double value : {0.2, 0.85}) {
    RenderOptions o = surface_at(orbit_camera(v.grid, 37, 21, 1), value, 65);
    o.sampler = SamplerKind::image3d;
    judge(v, o, j, 7 * field);
  }
  BOOST_TEST(j.hits > 500);
  BOOST_TEST(j.wrong == 0);
}
