// Pictures of certified volumes of real scans, held to F by its definition along random rays: every colour in
// its interval, every first crossing of a surface in its band (docs/pixel-bounds.md, "Tests"). The volume is
// not touched. scripts/long scan-pictures runs it on the demo's volume and the tooth's.
//   scan_pictures SCAN VOLUME.vdvr PICTURES [RAYS [FIRST]]

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "host/field/fdk/filter_cone.hpp"
#include "host/picture/rays/crossings.hpp"
#include "tests/support/analytic_pictures.hpp"
#include "tests/support/pixel_attack.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t side = 64;
// F is evaluated every eighth of a cell, where its band is oversampled fourfold or more, and interpolated by
// 10 points to 1/512 of a cell.
constexpr int an_eighth = 8, between = 64, points = 10;

/// F along a ray, from its values at first, first + h, ...
struct Line {
  reference::IdealRay ray;
  double first = 0, h = 0;
  std::vector<double> values;
  [[nodiscard]] bool empty() const { return values.empty(); }
  [[nodiscard]] double at(double t) const {
    const double x = (t - first) / h;
    const auto last = static_cast<std::int64_t>(values.size()) - points;
    const std::int64_t i = std::clamp<std::int64_t>(static_cast<std::int64_t>(x) - points / 2 + 1, 0, last);
    double sum = 0;
    for (int j = 0; j < points; ++j) {
      double weight = 1;
      for (int k = 0; k < points; ++k)
        if (k != j) weight *= (x - static_cast<double>(i + k)) / (j - k);
      sum += weight * values[static_cast<std::size_t>(i + j)];
    }
    return sum;
  }
};

struct Tally {
  std::int64_t pictures = 0, rays = 0, values = 0, outside = 0, crossings = 0, beside = 0;
  double nearest = 0, interpolation = 0;
};

RenderOptions random_options(const VdvrFile& file, std::mt19937& random, int number) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Grid& g = file.volume.grid;
  RenderOptions o;
  o.width = o.height = side;
  o.shading = false;
  o.sampler = SamplerKind::buffer;
  o.camera = orbit_camera(g, 360 * unit(random), 80 * unit(random) - 40, 1 + unit(random));
  const double radius = file.certificate.covered->radius;
  if (number % 3 == 2) {  // inside
    o.camera.position = {0.4 * radius * (2 * unit(random) - 1), 0.4 * radius * (2 * unit(random) - 1),
                         g.origin[2] + g.spacing[2] * static_cast<double>(g.cells[2]) * unit(random)};
    o.camera.focal_point = {radius, radius * (2 * unit(random) - 1), 0};
    o.camera.view_angle_deg = 60;
  }
  for (double& x : o.background_top) x = unit(random);
  o.background_bottom = o.background_top;
  o.clip = Clip{};
  o.clip->radius = radius;
  o.clip->low[2] = file.certificate.covered->z.first;
  o.clip->high[2] = file.certificate.covered->z.second;
  // Half of them soft, half with a jump; over the range of values.
  const double high = file.certificate.reference_range * 0.8;
  auto transfers = support::table_transfers();
  transfers.push_back(support::random_transfer(random));
  o.transfer = transfers[static_cast<std::size_t>(number) % transfers.size()];
  for (TransferPoint& p : o.transfer.points) p.value *= high;
  return o;
}

Line line_of(const ExactField& exact, const reference::IdealRay& ray, double unit) {
  Line line;
  line.ray = ray;
  if (!(ray.first < ray.last)) return line;
  // Short rays, through a slab of a cell, have as many values as interpolation wants.
  const auto n = std::max<std::size_t>(
      static_cast<std::size_t>(std::ceil((ray.last - ray.first) / unit * an_eighth)) + 1, 2 * points);
  line.first = ray.first;
  line.h = (ray.last - ray.first) / static_cast<double>(n - 1);
  std::vector<Vec3> where;
  for (std::size_t i = 0; i < n; ++i) where.push_back(ray.at(ray.first + static_cast<double>(i) * line.h));
  line.values = exact.at(where);
  return line;
}

/// What interpolation errs, where it was tried.
double interpolation_error(const ExactField& exact, const std::vector<Line>& lines, std::mt19937& random) {
  double most = 0;
  for (const Line& line : lines) {
    if (line.empty()) continue;
    std::vector<Vec3> where;
    std::vector<double> guessed;
    for (int k = 0; k < 8; ++k) {
      const auto i = static_cast<double>(random() % (line.values.size() - 1));
      const double t = line.first + (i + 0.5) * line.h;
      where.push_back(line.ray.at(t));
      guessed.push_back(line.at(t));
    }
    const auto right = exact.at(where);
    for (std::size_t k = 0; k < right.size(); ++k) most = std::max(most, std::abs(right[k] - guessed[k]));
  }
  return most;
}

// Whether F meets the value before `last`, where it is surely on one side: it comes as near to the other as
// it moves from one place of the line to the next.
bool meets(const Line& line, const ExactField& exact, const WorldRay& ray, double last, double value,
           double doubt) {
  const double end = exact.at(std::vector<Vec3>{ray.at(last)})[0], sign = end < value ? 1 : -1,
               step = line.h / (between / an_eighth);
  double other = sign * (end - value), moves = 0, before = end;
  for (double t = last - step; t > line.first; t -= step) {
    const double f = line.at(t);
    moves = std::max(moves, std::abs(f - before));
    other = std::max(other, sign * (f - value));
    before = f;
  }
  return other >= -moves - doubt;
}

void surfaces(const VdvrFile& file, const RayField& field, const ExactField& exact, const RenderOptions& o,
              const std::vector<std::size_t>& pixels, const std::vector<Line>& lines, double doubt,
              Tally& tally) {
  for (const double part : {0.3, 0.5}) {
    const double value = part * file.certificate.reference_range;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      if (lines[k].empty()) continue;
      const auto at = static_cast<std::int64_t>(pixels[k]);
      const WorldRay ray = pixel_ray(o.camera, side, side, at % side, at / side);
      const auto [begin, end] = field.clipped(ray);
      if (!(begin < end)) continue;
      const Crossing c = first_crossing(field, ray, value);
      ++tally.crossings;
      if (c.from_start) {
        if (c.hit == Hit::sure && !meets(lines[k], exact, ray, c.last, value, doubt)) ++tally.beside;
        continue;
      }
      const double at_begin = exact.at(std::vector<Vec3>{ray.at(begin)})[0];
      const double sign = at_begin < value ? 1 : -1, before = c.hit == Hit::none ? end : c.first;
      bool wrong = false;
      const double from = std::max(begin, lines[k].first), step = lines[k].h / (between / an_eighth);
      for (double t = from; t < std::min(before, lines[k].ray.last); t += step)
        wrong = wrong || !(sign * (lines[k].at(t) - value) < doubt);
      if (c.hit == Hit::sure)
        wrong =
            wrong || !(sign * (exact.at(std::vector<Vec3>{ray.at(c.last)})[0] - value) >= -exact.rounding());
      if (wrong) ++tally.beside;
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: scan_pictures SCAN VOLUME.vdvr PICTURES [RAYS [FIRST]]\n");
    return 2;
  }
  const VdvrFile file = read_vdvr(argv[2]);
  ScanOptions read;
  read.center = file.certificate.field.center;
  read.preparation = file.certificate.field.preparation;
  const ProjectionSet scan = read_scan(argv[1], read);
  const ExactField exact(scan, file.certificate.field);
  const Coverage coverage = certified_coverage(scan, file.certificate.field);
  const std::vector<float> bounds = brick_bounds(file.certificate, false);
  const RayField field(file.volume, bounds, coverage, file.certificate.roi);
  Device device;
  const ResidentVolume resident(device, file.volume);
  const Grid& g = file.volume.grid;
  const double unit = *std::min_element(g.spacing.begin(), g.spacing.end());
  const int count = std::atoi(argv[3]), wanted = argc > 4 ? std::atoi(argv[4]) : 16,
            begin = argc > 5 ? std::atoi(argv[5]) : 0;
  Tally tally;
  for (int number = begin; number < begin + count; ++number) {
    std::mt19937 random(300 + static_cast<unsigned>(number));
    const RenderOptions o = random_options(file, random, number);
    const PixelBounds first = certify_pixels(device, resident, bounds, o);
    // Half of the rays go where something may show.
    std::vector<std::size_t> shown, pixels;
    for (std::size_t i = 0; i < first.parts.size(); ++i)
      if (first.parts[i] > 0) shown.push_back(i);
    std::vector<Line> lines;
    const RenderOptions entered = support::as_entered(o, g);
    for (int k = 0; k < wanted; ++k) {
      pixels.push_back(k % 4 == 3 || shown.empty() ? random() % first.parts.size()
                                                   : shown[random() % shown.size()]);
      const auto i = static_cast<std::int64_t>(pixels.back());
      lines.push_back(line_of(exact, reference::ideal_ray(entered, g, i % side, i / side), unit));
    }
    const double error = 2 * interpolation_error(exact, lines, random);
    tally.interpolation = std::max(tally.interpolation, error);
    // The field that is constant on steps of 1/512 of a cell keeps the bounds too, if they allow for what F
    // moves in half a step, and for interpolation.
    std::vector<support::FieldOnRay> rays;
    double moves = 0;
    for (const Line& line : lines) {
      support::FieldOnRay ray;
      if (!line.empty()) {
        const auto n = (line.values.size() - 1) * between;
        ray.length = (line.ray.last - line.ray.first) / static_cast<double>(n) / unit;
        for (std::size_t i = 0; i < n; ++i)
          ray.values.push_back(line.at(line.first + (static_cast<double>(i) + 0.5) * line.h / between));
        for (std::size_t i = 0; i + 1 < n; ++i)
          moves = std::max(moves, std::abs(ray.values[i + 1] - ray.values[i]));
      }
      rays.push_back(std::move(ray));
    }
    std::vector<float> wider = bounds;
    for (float& e : wider) e += static_cast<float>(moves + error);
    const PixelBounds b = certify_pixels(device, resident, wider, o);
    std::int64_t outside = 0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      const auto behind = reference::background_of(o, static_cast<std::int64_t>(pixels[k]) / side);
      const auto colour = support::colour_of(rays[k], o.transfer.points, behind);
      for (std::size_t c = 0; c < 3; ++c, ++tally.values) {
        const double lo = static_cast<double>(b.lo.values[3 * pixels[k] + c]),
                     hi = static_cast<double>(b.hi.values[3 * pixels[k] + c]);
        // Of ends in fp32: as the attack allows.
        if (!(std::max(lo - colour[c], colour[c] - hi) <= 0x1p-12)) ++outside;
        if (hi - lo > 1.0 / 255)
          tally.nearest = std::max(tally.nearest, std::abs(2 * colour[c] - hi - lo) / (hi - lo));
      }
    }
    surfaces(file, field, exact, o, pixels, lines, error, tally);
    tally.outside += outside;
    ++tally.pictures;
    tally.rays += wanted;
    std::printf("picture %d, %s: %ld outside; e widened by %.2g\n", number, o.transfer.name.c_str(),
                static_cast<long>(outside), moves + error);
    std::fflush(stdout);
  }
  std::printf(
      "%ld pictures, %ld rays, %ld values, %ld outside, of half an interval F takes at most %.3f; %ld "
      "crossings, "
      "%ld outside their band; interpolation errs by %.2g\n",
      static_cast<long>(tally.pictures), static_cast<long>(tally.rays), static_cast<long>(tally.values),
      static_cast<long>(tally.outside), tally.nearest, static_cast<long>(tally.crossings),
      static_cast<long>(tally.beside), tally.interpolation);
  return tally.outside == 0 && tally.beside == 0 ? 0 : 1;
}
