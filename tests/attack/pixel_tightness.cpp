// How tight intervals of pixels are: beside the true error of V's picture, and beside what an adversary
// within the bounds reaches, on fields with an analytic F (docs/pixel-bounds.md, section 10). One row of a
// table for each field and transfer function. scripts/long pixel-tightness makes the table.
//   pixel_tightness FIELD CELLS LEVEL [ADVERSARY-EVERY]
// FIELD: marschner-lobb or blobs; LEVEL: samples 2^LEVEL to a cell; the adversary takes every so manieth
// pixel of a row and of a column (4; 0: none).

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "host/base/system/parallel.hpp"
#include "tests/support/analytic_pictures.hpp"
#include "tests/support/levels.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certify_picture.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t side = 64;
constexpr double step = 1.0 / 32;
// The prototype's: on black every level is a ninth more, or an eighth.
constexpr reference::Rgb3 background{0.1, 0.1, 0.1};

struct Scene {
  support::AnalyticField field;
  MixedVolume volume;
  std::vector<float> bounds;
  RenderOptions options;
  std::vector<std::size_t> hit;  // pixels whose rays meet the cube
  std::vector<support::FieldOnRay> f, v;
  std::vector<std::vector<double>> e;
};

Vec3 in_cells(const MixedVolume& v, const Vec3& p) {
  return {p[0] - v.grid.origin[0], p[1] - v.grid.origin[1], p[2] - v.grid.origin[2]};
}

Scene scene_of(const std::string& name, std::int64_t cells, std::uint8_t level) {
  Scene s;
  // Waves as dense as 6 on 64 cells.
  s.field = name == "blobs" ? support::blobs(cells)
                            : support::marschner_lobb(cells, 6.0 * static_cast<double>(cells) / 64);
  s.volume = support::volume_of(s.field, {{level, level, level}}, 1);
  s.bounds = support::proved_bounds(s.field, s.volume, 0, name == "blobs" ? 4 : 16);
  RenderOptions& o = s.options;
  o.width = o.height = side;
  o.shading = false;
  o.sampler = SamplerKind::buffer;
  o.background_top = o.background_bottom = background;
  o.camera = orbit_camera(s.volume.grid, 30, 20, 1.35);
  const auto pixels = static_cast<std::size_t>(side * side);
  s.f.resize(pixels);
  s.v.resize(pixels);
  s.e.resize(pixels);
  const Index3 n = s.volume.bricks();
  parallel_for(side, {}, "rays", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < side; ++x) {
      const auto i = static_cast<std::size_t>(y * side + x);
      const reference::IdealRay ray = reference::ideal_ray(o, s.volume.grid, x, y);
      s.f[i] = support::along_ray(
          [&](const Vec3& p) {
            const Vec3 c = in_cells(s.volume, p);
            return s.field.at(c[0], c[1], c[2]);
          },
          ray, step);
      s.v[i] = support::along_ray(
          [&](const Vec3& p) {
            const Index3 at = brick_at(s.volume, p);
            s.e[i].push_back(static_cast<double>(
                s.bounds[static_cast<std::size_t>((at[2] * n[1] + at[1]) * n[0] + at[0])]));
            return static_cast<double>(sample_at(s.volume, p));
          },
          ray, step);
    }
  });
  for (std::size_t i = 0; i < pixels; ++i)
    if (!s.f[i].values.empty()) s.hit.push_back(i);
  return s;
}

// By pixel the worst channel's bound of V's own picture, levels.
support::Levels bounds_of(const Scene& s, const TransferFunction& transfer, const PixelBounds& b) {
  support::Levels bound;
  for (const std::size_t i : s.hit) {
    const reference::Rgb3 v = support::colour_of(s.v[i], transfer.points, background);
    double most = 0;
    for (std::size_t c = 0; c < 3; ++c)
      most = std::max({most, static_cast<double>(b.hi.values[3 * i + c]) - v[c],
                       v[c] - static_cast<double>(b.lo.values[3 * i + c])});
    bound.values.push_back(255 * most);
  }
  return bound;
}

// Of the half widths of some pixels, what an adversary reaches.
double reached(const Scene& s, const TransferFunction& transfer, const PixelBounds& b, std::int64_t every,
               std::vector<double>& known) {
  double sum = 0, width = 0;
  std::vector<std::size_t> chosen;
  for (const std::size_t i : s.hit) {
    const auto at = static_cast<std::int64_t>(i);
    if (at % side % every == every / 2 && at / side % every == every / 2) chosen.push_back(i);
  }
  if (known.empty()) {
    known.resize(chosen.size());
    parallel_for(static_cast<std::int64_t>(chosen.size()), {}, "adversary", [&](std::int64_t k) {
      const std::size_t i = chosen[static_cast<std::size_t>(k)];
      for (std::size_t c = 0; c < 3; ++c)
        known[static_cast<std::size_t>(k)] +=
            support::adversary_of(s.v[i], s.e[i], transfer.points, background, c, true) -
            support::adversary_of(s.v[i], s.e[i], transfer.points, background, c, false);
    });
  }
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    sum += known[k];
    for (std::size_t c = 0; c < 3; ++c)
      width += static_cast<double>(b.hi.values[3 * chosen[k] + c]) -
               static_cast<double>(b.lo.values[3 * chosen[k] + c]);
  }
  return width > 0 ? sum / width : 1;
}

void row(Device& device, const ResidentVolume& resident, Scene& s, const TransferFunction& transfer,
         std::int64_t every) {
  s.options.transfer = transfer;
  CertifyPictureOptions half, eighth;
  eighth.kappa = 0.125;
  const auto certified = [&](CertifyPictureOptions c, bool by_box) {
    c.box = by_box;
    return certify_pixels(device, resident, s.bounds, s.options, c);
  };
  const PixelBounds b = certified(half, false), box = certified(half, true);
  support::Levels truth, bound = bounds_of(s, transfer, b);
  double parts = 0;
  for (const std::size_t i : s.hit) {
    const reference::Rgb3 f = support::colour_of(s.f[i], transfer.points, background),
                          v = support::colour_of(s.v[i], transfer.points, background);
    double off = 0;
    for (std::size_t c = 0; c < 3; ++c) off = std::max(off, std::abs(f[c] - v[c]));
    truth.values.push_back(255 * off);
    parts += b.parts[i];
  }
  std::vector<double> known;
  std::array<double, 4> share{};
  if (every > 0)
    share = {
        reached(s, transfer, b, every, known), reached(s, transfer, certified(eighth, false), every, known),
        reached(s, transfer, box, every, known), reached(s, transfer, certified(eighth, true), every, known)};
  for (double& x : share) x *= 100;
  std::printf(
      "| %s | %.2f, %.1f | %.2f, %.1f, %.1f | %.1f | %.1f | %.0f, %.0f, %.0f, %.0f | %.0f | %.0f, %.0f | "
      "%.2f | %.0f, %.0f |\n",
      transfer.name.c_str(), truth.mean(), truth.at(1), bound.mean(), bound.at(0.99), bound.at(1),
      bound.mean() / truth.mean(), bound.at(1) / truth.at(1), bound.within(1), bound.within(2),
      bound.within(4), bound.within(8), parts / static_cast<double>(s.hit.size()), share[0], share[1],
      bounds_of(s, transfer, box).mean(), share[2], share[3]);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: pixel_tightness marschner-lobb|blobs CELLS LEVEL [ADVERSARY-EVERY]\n");
    return 2;
  }
  Scene s = scene_of(argv[1], std::atoi(argv[2]), static_cast<std::uint8_t>(std::atoi(argv[3])));
  const std::int64_t every = argc > 4 ? std::atoi(argv[4]) : 4;
  double mean = 0, most = 0;
  for (const float e : s.bounds) {
    mean += static_cast<double>(e) / static_cast<double>(s.bounds.size());
    most = std::max(most, static_cast<double>(e));
  }
  std::printf("%s, %s cells, %d samples a cell: e mean %.4f, max %.4f; %zu rays\n", argv[1], argv[2],
              1 << std::atoi(argv[3]), mean, most, s.hit.size());
  std::printf(
      "| TF | true mean, max | bound mean, p99, max | mean ratio | max ratio | within 1, 2, 4, 8 (%%) | "
      "parts a ray | adversary at kappa 1/2, 1/8 (%%) | chord: bound mean | its adversary (%%) |\n");
  Device device;
  const ResidentVolume resident(device, s.volume);
  for (const TransferFunction& transfer : support::table_transfers())
    row(device, resident, s, transfer, every);
  return 0;
}
