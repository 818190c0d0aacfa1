#include "host/measure/measured_region.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/system/casts.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/noted_scan.hpp"

namespace vdvr {
namespace {

// Of a squared radius: far above what double precision loses of distances. What is that near counts as cut.
constexpr double near = 1e-11;

CoveredCylinder covered_cylinder(const Certificate& certificate) {
  if (certificate.covered) return *certificate.covered;
  const auto scan = noted_geometry(certificate);
  if (!scan)
    throw InputError(
        "the file does not say which points are covered: an earlier version or another program wrote it; "
        "build "
        "it again");
  return CertifiedRegion(*scan, certificate.field).cylinder();
}

/// Squares of the least and the largest distance between a round region's centre and a box.
Interval distances(const RoundRegion& r, const Vec3& low, const Vec3& high) {
  Interval d;
  for (std::size_t a = 0; a < (r.upright ? 2 : 3); ++a) {
    const double p = low[a] - r.center[a], q = high[a] - r.center[a],
                 least = p > 0   ? p
                         : q < 0 ? -q
                                 : 0,
                 most = std::max(std::abs(p), std::abs(q));
    d.lo += least * least;
    d.hi += most * most;
  }
  return d;
}

Place place_in(const RoundRegion& r, const Vec3& low, const Vec3& high) {
  const Interval d = distances(r, low, high);
  const double square = r.radius * r.radius;
  if (d.lo > square * (1 + near)) return Place::outside;
  return d.hi <= square * (1 - near) ? Place::inside : Place::cut;
}

/// radius^2 - distance^2 on a box. The squares of coordinates, which are not affine, only lower it.
AffineForm form_of(const RoundRegion& r, const Vec3& low, const Vec3& high) {
  AffineForm f;
  const double square = r.radius * r.radius;
  f.middle = square;
  for (std::size_t a = 0; a < (r.upright ? 2 : 3); ++a) {
    const double half = 0.5 * (high[a] - low[a]), from = low[a] + half - r.center[a];
    f.middle -= from * from;
    f.slope[a] = -2 * from * half;
    f.below += half * half;
  }
  const Interval d = distances(r, low, high);
  f.below += near * square;
  f.above = near * square;
  f.least = square * (1 - near) - d.hi;
  f.largest = square * (1 + near) - d.lo;
  return f;
}

void require_finite(const char* what, double value) {
  if (!std::isfinite(value)) throw InputError(fmt::format("{}: {} is no finite number", what, value));
}

void require_round(const RoundRegion& r) {
  for (const double c : r.center) require_finite(r.upright ? "cylinder" : "ball", c);
  if (!(r.radius > 0) || !std::isfinite(r.radius))
    throw InputError(
        fmt::format("{}: its radius is {}; it must be positive", r.upright ? "cylinder" : "ball", r.radius));
}

}  // namespace

MeasuredRegion::MeasuredRegion(const Grid& grid, const Certificate& certificate, const MeasureRegion& asked)
    : covered_(covered_cylinder(certificate)), rounds_(asked.rounds), mask_(asked.mask) {
  for (const RoundRegion& r : rounds_) require_round(r);
  rounds_.push_back({{0, 0, 0}, covered_.radius, true});
  for (std::size_t a = 0; a < 3; ++a) {
    low_[a] = grid.origin[a];
    high_[a] = grid.origin[a] + static_cast<double>(grid.cells[a]) * grid.spacing[a];
  }
  low_[2] = std::max(low_[2], covered_.z.first);
  high_[2] = std::min(high_[2], covered_.z.second);
  for (const auto& box : {certificate.roi, asked.box}) {
    if (!box) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      require_finite("roi", (*box)[a]);
      require_finite("roi", (*box)[a + 3]);
      if (!((*box)[a] < (*box)[a + 3]))
        throw InputError(fmt::format("roi: from {} to {} along {}; give x0, y0, z0, x1, y1, z1", (*box)[a],
                                     (*box)[a + 3], "xyz"[a]));
      low_[a] = std::max(low_[a], (*box)[a]);
      high_[a] = std::min(high_[a], (*box)[a + 3]);
    }
  }
  for (std::size_t a = 0; a < 3; ++a)
    if (!(low_[a] < high_[a]))
      throw InputError(fmt::format(
          "the region has no volume within what is certified, which along {} lies from {:.6g} to {:.6g}",
          "xyz"[a], (a == 2 ? covered_.z.first : grid.origin[a]) + 0.0,  // not the zero with a sign
          a == 2 ? covered_.z.second
                 : grid.origin[a] + static_cast<double>(grid.cells[a]) * grid.spacing[a]));
  for (const RoundRegion& r : rounds_)
    if (place_in(r, low_, high_) == Place::outside)
      throw InputError(fmt::format(
          "the region has no volume within what is certified: a cylinder about x = y = 0 of radius "
          "{:.6g}, z from {:.6g} to {:.6g}",
          covered_.radius, covered_.z.first, covered_.z.second));
  if (mask_ && place_in_mask(low_, high_) == Place::outside)
    throw InputError("the mask has no sample other than 0 in the region");
}

Place MeasuredRegion::place_in_box(const Vec3& low, const Vec3& high) const {
  Place place = Place::inside;
  for (std::size_t a = 0; a < 3; ++a) {
    if (high[a] < low_[a] || low[a] > high_[a]) return Place::outside;
    if (low[a] < low_[a] || high[a] > high_[a]) place = Place::cut;
  }
  return place;
}

Place MeasuredRegion::place(const Vec3& low, const Vec3& high) const {
  Place all = place_in_box(low, high);
  for (const RoundRegion& r : rounds_) {
    if (all == Place::outside) return all;
    all = std::min(all, place_in(r, low, high));
  }
  if (mask_ && all != Place::outside) all = std::min(all, place_in_mask(low, high));
  return all;
}

Interval MeasuredRegion::share(const Vec3& low, const Vec3& high) const {
  if (mask_ && place_in_mask(low, high) == Place::outside) return {0, 0};
  // Of what several regions leave out, each its own.
  double left_out = 0, most = 1;
  for (const RoundRegion& r : rounds_) {
    const Interval s = share_above(form_of(r, low, high), 0);
    left_out += 1 - s.lo;
    most = std::min(most, s.hi);
  }
  return {std::max(0.0, 1 - left_out), most};
}

bool MeasuredRegion::holds_point(const Vec3& low, const Vec3& high) const {
  if (mask_ && place_in_mask(low, high) != Place::inside) return false;
  if (place_in_box(low, high) == Place::outside) return false;
  Vec3 from{}, to{};
  for (std::size_t a = 0; a < 3; ++a) {
    from[a] = std::max(low[a], low_[a]);
    to[a] = std::min(high[a], high_[a]);
  }
  const auto inside = [&](const Vec3& p) {
    return std::all_of(rounds_.begin(), rounds_.end(),
                       [&](const RoundRegion& r) { return place_in(r, p, p) == Place::inside; });
  };
  const auto nearest = [&](const RoundRegion& r) {
    Vec3 p{};
    for (std::size_t a = 0; a < 3; ++a)
      p[a] = r.upright && a == 2 ? 0.5 * (from[a] + to[a]) : std::clamp(r.center[a], from[a], to[a]);
    return p;
  };
  return std::any_of(rounds_.begin(), rounds_.end(),
                     [&](const RoundRegion& r) { return inside(nearest(r)); });
}

bool MeasuredRegion::is_upright() const {
  return std::all_of(rounds_.begin(), rounds_.end(), [](const RoundRegion& r) { return r.upright; });
}

std::vector<double> MeasuredRegion::faces(std::size_t axis) const {
  double low = low_[axis], high = high_[axis];
  for (const RoundRegion& r : rounds_)
    if (!(r.upright && axis == 2)) {
      low = std::max(low, r.center[axis] - r.radius);
      high = std::min(high, r.center[axis] + r.radius);
    }
  std::vector<double> out{low};
  if (mask_) {
    const auto [first, last] = mask_range(axis, low, high);
    for (std::int64_t i = first + 1; i <= last; ++i)
      if (const double face = mask_face(axis, i); face > out.back() && face < high) out.push_back(face);
  }
  out.push_back(high);
  return out;
}

double MeasuredRegion::length_along(const Vec3& p, const Vec3& d) const {
  double from = -std::numeric_limits<double>::infinity(), to = -from;
  for (std::size_t a = 0; a < 3; ++a) {
    if (d[a] == 0) {
      if (p[a] < low_[a] || p[a] > high_[a]) return 0;
      continue;
    }
    const double s = (low_[a] - p[a]) / d[a], t = (high_[a] - p[a]) / d[a];
    from = std::max(from, std::min(s, t));
    to = std::min(to, std::max(s, t));
  }
  for (const RoundRegion& r : rounds_) {
    double dd = 0, pd = 0, pp = 0;
    for (std::size_t a = 0; a < (r.upright ? 2 : 3); ++a) {
      dd += d[a] * d[a];
      pd += (p[a] - r.center[a]) * d[a];
      pp += (p[a] - r.center[a]) * (p[a] - r.center[a]);
    }
    const double rest = r.radius * r.radius - pp;
    if (dd == 0) {
      if (rest < 0) return 0;
      continue;
    }
    const double root = pd * pd + dd * rest;
    if (!(root > 0)) return 0;
    from = std::max(from, (-pd - std::sqrt(root)) / dd);
    to = std::min(to, (-pd + std::sqrt(root)) / dd);
  }
  if (!(from < to)) return 0;
  return mask_ ? length_in_mask(p, d, from, to) : to - from;
}

// From face to face of the mask's samples.
double MeasuredRegion::length_in_mask(const Vec3& p, const Vec3& d, double from, double to) const {
  const Index3 n = mask_->grid.samples();
  Index3 i{};
  Vec3 next{}, step{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double x = (p[a] + from * d[a] - mask_->grid.origin[a]) / mask_->grid.spacing[a] + 0.5;
    // Before the first sample and behind the last one there is one of 0.
    i[a] = static_cast<std::int64_t>(std::floor(std::clamp(x, -1.0, static_cast<double>(n[a]))));
    step[a] = d[a] == 0 ? std::numeric_limits<double>::infinity() : mask_->grid.spacing[a] / std::abs(d[a]);
    next[a] = d[a] == 0 ? step[a] : (mask_face(a, i[a] + (d[a] > 0 ? 1 : 0)) - p[a]) / d[a];
  }
  double sum = 0, at_s = from;
  while (at_s < to) {
    const auto a = static_cast<std::size_t>(std::min_element(next.begin(), next.end()) - next.begin());
    const double end = std::clamp(next[a], at_s, to);
    if (i[0] >= 0 && i[1] >= 0 && i[2] >= 0 && i[0] < n[0] && i[1] < n[1] && i[2] < n[2] &&
        mask_->samples[at((i[2] * n[1] + i[1]) * n[0] + i[0])] != 0)
      sum += end - at_s;
    at_s = end;
    i[a] += d[a] > 0 ? 1 : -1;
    if ((d[a] > 0 && i[a] > n[a]) || (d[a] < 0 && i[a] < -1)) break;
    next[a] += step[a];
  }
  return sum;
}

double MeasuredRegion::mask_face(std::size_t axis, std::int64_t i) const {
  return mask_->grid.origin[axis] + (static_cast<double>(i) - 0.5) * mask_->grid.spacing[axis];
}

// Samples whose boxes meet the inside of the interval; they may lie beyond the mask.
std::pair<std::int64_t, std::int64_t> MeasuredRegion::mask_range(std::size_t a, double low,
                                                                 double high) const {
  const auto below = [&](double x) {  // the last sample whose lower face is at most x
    const double guess = std::clamp(std::floor((x - mask_->grid.origin[a]) / mask_->grid.spacing[a] + 0.5),
                                    -1.0, static_cast<double>(mask_->grid.cells[a] + 1));
    auto i = static_cast<std::int64_t>(guess);
    while (i > -1 && mask_face(a, i) > x) --i;
    while (i <= mask_->grid.cells[a] && mask_face(a, i + 1) <= x) ++i;
    return i;
  };
  const std::int64_t first = below(low);
  std::int64_t last = below(high);
  if (last > first && mask_face(a, last) >= high) --last;
  return {first, last};
}

Place MeasuredRegion::place_in_mask(const Vec3& low, const Vec3& high) const {
  std::array<std::pair<std::int64_t, std::int64_t>, 3> range;
  for (std::size_t a = 0; a < 3; ++a) range[a] = mask_range(a, low[a], high[a]);
  const Index3 n = mask_->grid.samples();
  bool any = false, all = true;
  for (std::int64_t z = range[2].first; z <= range[2].second; ++z)
    for (std::int64_t y = range[1].first; y <= range[1].second; ++y)
      for (std::int64_t x = range[0].first; x <= range[0].second; ++x) {
        const bool within = x >= 0 && y >= 0 && z >= 0 && x < n[0] && y < n[1] && z < n[2] &&
                            mask_->samples[at((z * n[1] + y) * n[0] + x)] != 0;
        any |= within;
        all &= within;
        if (any && !all) return Place::cut;
      }
  return all ? Place::inside : Place::outside;
}

std::optional<MeasuredRegion::Plane> MeasuredRegion::mask_plane(const Vec3& low, const Vec3& high) const {
  if (!mask_ || place_in_mask(low, high) != Place::cut) return std::nullopt;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto [first, last] = mask_range(a, low[a], high[a]);
    if (first == last) continue;
    const double at = mask_face(a, first + (last - first + 1) / 2);
    return Plane{a, at};
  }
  return std::nullopt;
}

}  // namespace vdvr
