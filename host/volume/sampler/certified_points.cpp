#include "vdvr/expert/certified_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/volume/sampler/sample_box.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/noted_scan.hpp"
#include "vdvr/expert/region_of_interest.hpp"

namespace vdvr {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
/// Of a spacing: what a box given as text may miss its last point by.
constexpr double kFace = 1e-6;

void require_fit(std::size_t points, std::size_t room) {
  if (points != room) throw InputError(fmt::format("out: room for {} values of {} points", room, points));
}

/// body(i, point) over the lattice, z slowest, one row along x at a time.
template <class Body>
void for_lattice(const Lattice& lattice, const Progress& progress, const char* stage, const Body& body) {
  const std::int64_t nx = lattice.count[0], ny = lattice.count[1];
  parallel_for(ny * lattice.count[2], progress, stage, [&](std::int64_t row) {
    for (std::int64_t x = 0; x < nx; ++x) body(at(row * nx + x), lattice.position({x, row % ny, row / ny}));
  });
}

/// body(i) over so many points, in blocks that are large beside taking one.
template <class Body>
void for_points(std::size_t count, const Progress& progress, const char* stage, const Body& body) {
  constexpr std::size_t block = 1024;
  parallel_for(static_cast<std::int64_t>((count + block - 1) / block), progress, stage, [&](std::int64_t b) {
    const std::size_t first = static_cast<std::size_t>(b) * block;
    for (std::size_t i = first; i < std::min(count, first + block); ++i) body(i);
  });
}

}  // namespace

Lattice lattice_in(const Grid& grid, const std::optional<Vec3>& spacing,
                   const std::optional<std::array<double, 6>>& box) {
  Lattice lattice{grid.origin, spacing.value_or(grid.spacing), {}, {}};
  for (std::size_t a = 0; a < 3; ++a) {
    const double step = lattice.spacing[a];
    if (!(step > 0) || !std::isfinite(step))
      throw InputError(fmt::format("spacing: {} along {}; it must be positive", step, "xyz"[a]));
    const double far = static_cast<double>(grid.cells[a]) * grid.spacing[a];
    double lo = 0, hi = far;
    if (box) {
      const double from = (*box)[a], to = (*box)[a + 3];
      if (!std::isfinite(from) || !std::isfinite(to) || !(from <= to))
        throw InputError(
            fmt::format("box: from {} to {} along {}; give x0, y0, z0, x1, y1, z1", from, to, "xyz"[a]));
      lo = std::max(lo, from - grid.origin[a]);
      hi = std::min(hi, to - grid.origin[a]);
    }
    const double first = std::ceil(lo / step - kFace), last = std::floor(hi / step + kFace);
    if (!(first <= last))
      throw InputError(
          fmt::format("box: holds no point of spacing {} along {}; the volume reaches from {} to {}", step,
                      "xyz"[a], grid.origin[a], grid.origin[a] + far));
    if (!(last < 0x1p31))
      throw InputError(fmt::format("spacing: {} along {} makes too many points", step, "xyz"[a]));
    lattice.first[a] = static_cast<std::int64_t>(first);
    lattice.count[a] = static_cast<std::int64_t>(last) - lattice.first[a] + 1;
  }
  // Each count is at most 2^31, so that two of them multiplied fit.
  constexpr std::int64_t most = std::int64_t{1} << 40;
  if (lattice.count[0] * lattice.count[1] > most / lattice.count[2])
    throw InputError(fmt::format("spacing: {} x {} x {} points are too many", lattice.count[0],
                                 lattice.count[1], lattice.count[2]));
  return lattice;
}

void values_on(const MixedVolume& v, const Lattice& lattice, std::span<float> out, const Progress& progress) {
  require_fit(static_cast<std::size_t>(lattice.size()), out.size());
  if (const auto box = exact_box(v, lattice)) {
    report(progress, "sample", 0);
    sample_box_parallel(v, *box, out.data());
    return;
  }
  for_lattice(lattice, progress, "sample", [&](std::size_t i, const Vec3& p) { out[i] = sample_at(v, p); });
}

CertifiedPoints::CertifiedPoints(const MixedVolume& volume, const Certificate& certificate,
                                 const std::optional<ProjectionSet>& geometry)
    : volume_(&volume), certificate_(&certificate) {
  const auto noted = geometry ? std::nullopt : noted_geometry(certificate);
  if (!geometry && !noted)
    throw InputError("the certificate does not say which points are covered: give the projections' geometry");
  region_.emplace(geometry ? *geometry : *noted, certificate.field);
  if (!certificate.brick_totals.empty()) brick_bounds_ = brick_bounds(certificate, false);
}

bool CertifiedPoints::covered(const Vec3& p) const {
  const Grid& g = volume_->grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const double cell = (p[a] - g.origin[a]) / g.spacing[a];
    if (!(cell >= 0 && cell <= static_cast<double>(g.cells[a]))) return false;
  }
  return region_->contains(p);
}

bool CertifiedPoints::promised(const Vec3& p) const {
  return !certificate_->comparison && !certificate_->window && covered(p) && is_inside(certificate_->roi, p);
}

std::size_t CertifiedPoints::brick_of(const Vec3& p) const {
  const Index3 b = brick_at(*volume_, p), n = volume_->bricks();
  return at((b[2] * n[1] + b[1]) * n[0] + b[0]);
}

LevelTriple CertifiedPoints::level(const Vec3& p) const { return volume_->level[brick_of(p)]; }

float CertifiedPoints::bound(const Vec3& p) const {
  if (brick_bounds_.empty()) return std::nextafter(static_cast<float>(certificate_->total_buffer), HUGE_VALF);
  return brick_bounds_[brick_of(p)];
}

float CertifiedPoints::bound_or_nan(const Vec3& p) const { return promised(p) ? bound(p) : kNothing; }

float CertifiedPoints::sigma(const Vec3& p) const {
  return certificate_->brick_sigma.empty() ? kNothing : certificate_->brick_sigma[brick_of(p)];
}

void CertifiedPoints::values(std::span<const Vec3> points, std::span<float> out,
                             const Progress& progress) const {
  require_fit(points.size(), out.size());
  for_points(points.size(), progress, "sample",
             [&](std::size_t i) { out[i] = covered(points[i]) ? sample_at(*volume_, points[i]) : kNothing; });
}

void CertifiedPoints::bounds(std::span<const Vec3> points, std::span<float> out,
                             const Progress& progress) const {
  require_fit(points.size(), out.size());
  for_points(points.size(), progress, "bound", [&](std::size_t i) { out[i] = bound_or_nan(points[i]); });
}

void CertifiedPoints::bounds(const Lattice& lattice, std::span<float> out, const Progress& progress) const {
  require_fit(static_cast<std::size_t>(lattice.size()), out.size());
  for_lattice(lattice, progress, "bound", [&](std::size_t i, const Vec3& p) { out[i] = bound_or_nan(p); });
}

void CertifiedPoints::sigmas(std::span<const Vec3> points, std::span<float> out,
                             const Progress& progress) const {
  require_fit(points.size(), out.size());
  for_points(points.size(), progress, "sigma",
             [&](std::size_t i) { out[i] = covered(points[i]) ? sigma(points[i]) : kNothing; });
}

}  // namespace vdvr
