// How tight intervals of lit pixels are: the error of V's picture under its own light beside the bound, and
// beside what an adversary reaches who chooses values and differences within their bounds, on fields with an
// analytic F (docs/pixel-bounds.md, section 7). scripts/long lit-tightness makes the table.
//   lit_tightness FIELD CELLS LEVEL
// FIELD: marschner-lobb or blobs; LEVEL: samples 2^LEVEL to a cell.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "host/base/system/parallel.hpp"
#include "tests/support/levels.hpp"
#include "tests/support/lit_pictures.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certify_picture.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t side = 64;
constexpr double step = 1.0 / 16;

struct Scene {
  support::AnalyticField field;
  MixedVolume volume;
  std::vector<float> bounds;
  RenderOptions options;
  std::vector<std::size_t> hit;
  std::vector<support::LitFieldOnRay> f, v;
  std::vector<std::vector<double>> e;
  std::vector<std::vector<Vec3>> d;
};

double bound_at(const Scene& s, const Vec3& p) {
  const Index3 at = brick_at(s.volume, p), n = s.volume.bricks();
  return static_cast<double>(s.bounds[static_cast<std::size_t>((at[2] * n[1] + at[1]) * n[0] + at[0])]);
}

void take_ray(Scene& s, std::size_t i) {
  const auto at = static_cast<std::int64_t>(i);
  const reference::IdealRay ray = reference::ideal_ray(s.options, s.volume.grid, at % side, at / side);
  const Vec3& low = s.volume.grid.origin;
  s.f[i] = support::along_lit_ray(
      [&](const Vec3& p) { return s.field.at(p[0] - low[0], p[1] - low[1], p[2] - low[2]); }, ray, step);
  s.v[i] = support::along_lit_ray([&](const Vec3& p) { return static_cast<double>(sample_at(s.volume, p)); },
                                  ray, step);
  const support::LitFieldOnRay e =
      support::along_lit_ray([&](const Vec3& p) { return bound_at(s, p); }, ray, step);
  s.e[i] = e.values;
  for (const auto& around : e.around)
    s.d[i].push_back({around[0][0] + around[0][1], around[1][0] + around[1][1], around[2][0] + around[2][1]});
}

Scene scene_of(const std::string& name, std::int64_t cells, std::uint8_t level) {
  Scene s;
  s.field = name == "blobs" ? support::blobs(cells)
                            : support::marschner_lobb(cells, 6.0 * static_cast<double>(cells) / 64);
  s.volume = support::volume_of(s.field, {{level, level, level}}, 1);
  s.bounds = support::proved_bounds(s.field, s.volume, 0, name == "blobs" ? 4 : 16);
  RenderOptions& o = s.options;
  o.width = o.height = side;
  support::set_lights(o, 0);
  o.sampler = SamplerKind::buffer;
  o.background_top = o.background_bottom = {0, 0, 0};
  o.camera = orbit_camera(s.volume.grid, 30, 20, 1.35);
  o.clip = support::inner_clip(s.volume.grid);
  const auto pixels = static_cast<std::size_t>(side * side);
  s.f.resize(pixels);
  s.v.resize(pixels);
  s.e.resize(pixels);
  s.d.resize(pixels);
  parallel_for(static_cast<std::int64_t>(pixels), {}, "rays",
               [&](std::int64_t i) { take_ray(s, static_cast<std::size_t>(i)); });
  for (std::size_t i = 0; i < pixels; ++i)
    if (!s.f[i].values.empty()) s.hit.push_back(i);
  return s;
}

/// Of the middle pixels of squares of 8 x 8, how much of the interval an adversary takes, all channels.
double reached(const Scene& s, double full, const PixelBounds& b) {
  double sum = 0, width = 0;
  std::vector<std::size_t> chosen;
  for (const std::size_t i : s.hit)
    if (i % side % 8 == 4 && i / side % 8 == 4) chosen.push_back(i);
  std::vector<double> span(chosen.size());
  parallel_for(static_cast<std::int64_t>(chosen.size()), {}, "adversary", [&](std::int64_t k) {
    const std::size_t i = chosen[static_cast<std::size_t>(k)];
    const auto at = static_cast<std::int64_t>(i);
    const Vec3 view = reference::ideal_ray(s.options, s.volume.grid, at % side, at / side).direction;
    std::mt19937 random(static_cast<unsigned>(i));
    for (std::size_t c = 0; c < 3; ++c)
      for (const bool up : {false, true})
        span[static_cast<std::size_t>(k)] +=
            (up ? 1 : -1) *
            support::lit_adversary_of(s.v[i], s.e[i], s.d[i], s.options, view, full, 0, c, up, random);
  });
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    sum += span[k];
    for (std::size_t c = 0; c < 3; ++c)
      width += static_cast<double>(b.hi.values[3 * chosen[k] + c]) -
               static_cast<double>(b.lo.values[3 * chosen[k] + c]);
  }
  return width > 0 ? sum / width : 1;
}

void row(Device& device, const ResidentVolume& resident, Scene& s, const TransferFunction& transfer) {
  RenderOptions& o = s.options;
  o.transfer = transfer;
  const std::pair<float, float> range = resident.value_range();
  const double full = static_cast<double>((range.second - range.first) / 32);
  const PixelBounds lit = certify_lit_pixels(s.volume, s.bounds, Clip{}, range, o),
                    drawn = certify_pixels(device, resident, s.bounds, o);
  support::Levels truth, bound, as_drawn;
  for (const std::size_t i : s.hit) {
    const auto at = static_cast<std::int64_t>(i);
    const Vec3 view = reference::ideal_ray(o, s.volume.grid, at % side, at / side).direction;
    const reference::Rgb3 f = support::lit_colour_of(s.f[i], o, view, full, {0, 0, 0}),
                          v = support::lit_colour_of(s.v[i], o, view, full, {0, 0, 0});
    double off = 0, most = 0, half = 0;
    const auto shown = [](float x) { return std::clamp(static_cast<double>(x), 0.0, 1.0); };
    for (std::size_t c = 0; c < 3; ++c) {
      const double seen = std::clamp(v[c], 0.0, 1.0);
      off = std::max(off, std::abs(std::clamp(f[c], 0.0, 1.0) - seen));
      most = std::max({most, shown(lit.hi.values[3 * i + c]) - seen, seen - shown(lit.lo.values[3 * i + c])});
      half = std::max(half, (shown(drawn.hi.values[3 * i + c]) - shown(drawn.lo.values[3 * i + c])) / 2);
    }
    truth.values.push_back(255 * off);
    bound.values.push_back(255 * most);
    as_drawn.values.push_back(255 * half);
  }
  std::printf("| %s | %.2f, %.1f | %.2f, %.1f | %.2f, %.1f | %.0f | %.2f |\n", transfer.name.c_str(),
              truth.mean(), truth.most(), bound.mean(), bound.most(), as_drawn.mean(), as_drawn.most(),
              100 * reached(s, full, lit), lit.seconds);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: lit_tightness marschner-lobb|blobs CELLS LEVEL\n");
    return 2;
  }
  Scene s = scene_of(argv[1], std::atoi(argv[2]), static_cast<std::uint8_t>(std::atoi(argv[3])));
  double mean = 0;
  for (const float e : s.bounds) mean += static_cast<double>(e) / static_cast<double>(s.bounds.size());
  std::printf("%s, %s cells, %d samples a cell: e mean %.4f; %zu rays\n", argv[1], argv[2],
              1 << std::atoi(argv[3]), mean, s.hit.size());
  std::printf("| TF | true mean, max | bound mean, max | half width as drawn | adversary (%%) | seconds |\n");
  Device device;
  const ResidentVolume resident(device, s.volume);
  for (const char* name : {"soft", "default", "marschner-lobb"})
    row(device, resident, s, transfer_preset(name, 0, 1));
  return 0;
}
