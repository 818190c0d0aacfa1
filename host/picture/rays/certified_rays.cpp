#include "vdvr/expert/certified_rays.hpp"

#include <algorithm>
#include <limits>

#include "host/base/system/outward.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/picture/rays/crossings.hpp"
#include "host/picture/rays/line_integral.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/noted_scan.hpp"

namespace vdvr {
namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

FloatImage empty(std::int64_t width, std::int64_t height, float value) {
  return {width, height, std::vector<float>(static_cast<std::size_t>(width * height), value)};
}
ProjectionSet geometry_of(const Certificate& certificate) {
  auto scan = noted_geometry(certificate);
  if (!scan)
    throw InputError(
        "the file does not say which points are covered: another program wrote it without; build it "
        "again");
  return std::move(*scan);
}

/// What lies in both.
std::optional<std::array<double, 6>> common_box(const std::optional<std::array<double, 6>>& a,
                                                const std::optional<std::array<double, 6>>& b) {
  if (!a || !b) return a ? a : b;
  std::array<double, 6> box = *a;
  for (std::size_t i = 0; i < 3; ++i) {
    box[i] = std::max(box[i], (*b)[i]);
    box[i + 3] = std::min(box[i + 3], (*b)[i + 3]);
  }
  return box;
}

}  // namespace

double SurfaceBounds::share(std::uint8_t kind) const {
  return hit.empty() ? 0
                     : static_cast<double>(std::count(hit.begin(), hit.end(), kind)) /
                           static_cast<double>(hit.size());
}

struct CertifiedRays::Impl {
  Impl(const MixedVolume& volume, const Certificate& certificate, const ProjectionSet& scan, bool image3d,
       const std::optional<std::array<double, 6>>& box)
      : bounds(brick_bounds(certificate, image3d)),
        coverage(certified_coverage(scan, certificate.field)),
        field(volume, bounds, coverage, common_box(certificate.roi, box)) {
    if (certificate.window)
      throw InputError(
          "the certificate has a window: outside of it nothing bounds |V - F|, so that nothing can "
          "be said of whole rays; build without --window");
  }
  std::vector<float> bounds;
  Coverage coverage;
  RayField field;
};

CertifiedRays::CertifiedRays(const MixedVolume& volume, const Certificate& certificate,
                             const ProjectionSet& scan, bool image3d)
    : impl_(std::make_unique<Impl>(volume, certificate, scan, image3d, std::nullopt)) {}
CertifiedRays::CertifiedRays(const MixedVolume& volume, const Certificate& certificate, bool image3d,
                             const std::optional<std::array<double, 6>>& box)
    : impl_(std::make_unique<Impl>(volume, certificate, geometry_of(certificate), image3d, box)) {}
CertifiedRays::~CertifiedRays() = default;

SurfaceBounds CertifiedRays::surface(const Camera& camera, std::int64_t width, std::int64_t height,
                                     double value, const Progress& progress) const {
  SurfaceBounds out{std::vector<std::uint8_t>(static_cast<std::size_t>(width * height)),
                    empty(width, height, nothing), empty(width, height, nothing)};
  parallel_for(height, progress, "certify", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < width; ++x) {
      const Crossing c = first_crossing(impl_->field, pixel_ray(camera, width, height, x, y), value);
      const auto i = static_cast<std::size_t>(y * width + x);
      out.hit[i] = static_cast<std::uint8_t>(c.hit);
      if (c.hit != Hit::none) out.first.values[i] = down(c.first);
      if (c.hit == Hit::sure) out.last.values[i] = up(c.last);
    }
  });
  return out;
}

MaximumBounds CertifiedRays::maximum(const Camera& camera, std::int64_t width, std::int64_t height,
                                     const Progress& progress) const {
  MaximumBounds out;
  for (FloatImage* image : {&out.low, &out.high, &out.first, &out.last})
    *image = empty(width, height, nothing);
  parallel_for(height, progress, "certify", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < width; ++x) {
      const Maximum m = maximum_along(impl_->field, pixel_ray(camera, width, height, x, y));
      if (!m.any) continue;
      const auto i = static_cast<std::size_t>(y * width + x);
      out.low.values[i] = down(m.low);
      out.high.values[i] = up(m.high);
      out.first.values[i] = down(m.first);
      out.last.values[i] = up(m.last);
    }
  });
  return out;
}

IntegralBounds CertifiedRays::integral(const Camera& camera, std::int64_t width, std::int64_t height,
                                       const Progress& progress) const {
  IntegralBounds out{empty(width, height, 0), empty(width, height, 0),
                     std::vector<std::uint8_t>(static_cast<std::size_t>(width * height))};
  parallel_for(height, progress, "certify", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < width; ++x) {
      const LineIntegral line = integral_along(impl_->field, pixel_ray(camera, width, height, x, y));
      const auto i = static_cast<std::size_t>(y * width + x);
      out.met[i] = line.any ? 1 : 0;
      out.low.values[i] = down(line.value - line.reach);
      out.high.values[i] = up(line.value + line.reach);
    }
  });
  return out;
}

}  // namespace vdvr
