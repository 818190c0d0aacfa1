// Round by round: bounds of all pixels, bricks' shares in those that are above, smaller bounds for these
// bricks.
#include "vdvr/picture_refinement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/fdk/filter_cone.hpp"
#include "host/rays/emission.hpp"
#include "host/system/parallel.hpp"
#include "host/views/shares.hpp"
#include "host/views/spend.hpp"
#include "vdvr/certificate.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Of the tolerance: what is aimed at, since shares are no bounds.
constexpr double aim = 0.93;
// Of the worst pixel: what one round aims at. Far from the tolerance shares say little of how far.
constexpr double round_share = 0.4;

std::uint64_t samples_of(const MixedVolume& volume) {
  std::uint64_t sum = volume.base.size();
  for (const auto& [kind, block] : volume.tiles) sum += block.size();
  return sum;
}

// For either sampler of the device.
std::vector<float> bounds_of(const Certificate& certificate) {
  std::vector<float> bounds = brick_bounds(certificate, false);
  if (!certificate.budget.sampler.image3d) return bounds;
  const std::vector<float> image = brick_bounds(certificate, true);
  for (std::size_t i = 0; i < bounds.size(); ++i) bounds[i] = std::max(bounds[i], image[i]);
  return bounds;
}

// Closing gives a brick what coarser ones beside it have along all that they share, so these are raised
// there. To ask twice as much of them as of the brick between them finds most of that at once: repair goes a
// level at a time.
void grade_bounds(std::vector<float>& bounds, const Index3& n) {
  constexpr float beside = 2;
  const std::vector<float> before = bounds;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        float& own = bounds[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)];
        for (std::int64_t k = std::max<std::int64_t>(0, z - 1); k <= std::min(n[2] - 1, z + 1); ++k)
          for (std::int64_t j = std::max<std::int64_t>(0, y - 1); j <= std::min(n[1] - 1, y + 1); ++j)
            for (std::int64_t i = std::max<std::int64_t>(0, x - 1); i <= std::min(n[0] - 1, x + 1); ++i)
              own = std::min(own, beside * before[static_cast<std::size_t>((k * n[1] + j) * n[0] + i)]);
      }
}

}  // namespace

struct PictureRefinement::Impl {
  Impl(WantedViews of, const ProjectionSet& scan, const FieldOptions& field, PictureRefinementOptions o,
       Progress p)
      : wanted(std::move(of)),
        coverage(certified_coverage(scan, field)),
        options(std::move(o)),
        progress(std::move(p)) {}

  std::vector<float> ask(const MixedVolume& volume, const Certificate& certificate);
  struct Pixel {
    double bound = 0;  // levels of 255
    PixelShares shares;
  };
  [[nodiscard]] std::vector<Pixel> pixels_of(const RayField& field) const;
  std::vector<PixelDemand> demands_of(const std::vector<Pixel>& pixels, const std::vector<float>& bounds,
                                      double allowed) const;

  WantedViews wanted;
  Coverage coverage;
  PictureRefinementOptions options;
  Progress progress;
  PictureViews views;
  std::vector<PictureRound> rounds;
  std::vector<float> loosest;  // bounds of bricks, of all volumes that were looked at
};

// Certified bounds beside what V's own picture shows there; shares of those that are above the tolerance.
std::vector<PictureRefinement::Impl::Pixel> PictureRefinement::Impl::pixels_of(const RayField& field) const {
  std::vector<Pixel> pixels;
  const MediumRanges ranges(views.transfer);
  const auto count = static_cast<double>(views.cameras.size());
  for (std::size_t view = 0; view < views.cameras.size(); ++view) {
    const auto report_view = [&](const std::string&, double part) {
      report(progress, "pictures", (static_cast<double>(view) + part) / count);
    };
    std::vector<PixelShares> shares = pixel_shares(field, views, view);
    const std::size_t first = pixels.size();
    pixels.resize(first + shares.size());
    parallel_for(views.height, report_view, "pictures", [&](std::int64_t y) {
      for (std::int64_t x = 0; x < views.width; ++x) {
        const auto i = static_cast<std::size_t>(y * views.width + x);
        const ColourInterval w =
            colour_interval(field, pixel_ray(views.cameras[view], views.width, views.height, x, y), ranges,
                            background_of(views, y));
        Pixel& pixel = pixels[first + i];
        for (std::size_t c = 0; c < 3; ++c)
          pixel.bound = std::max(
              {pixel.bound, 255 * (w.high[c] - shares[i].colour[c]), 255 * (shares[i].colour[c] - w.low[c])});
        if (pixel.bound > options.levels) pixel.shares = std::move(shares[i]);
      }
    });
  }
  return pixels;
}

// Shares are scaled so that they add up to the pixel's bound.
std::vector<PixelDemand> PictureRefinement::Impl::demands_of(const std::vector<Pixel>& pixels,
                                                             const std::vector<float>& bounds,
                                                             double allowed) const {
  std::vector<PixelDemand> demands;
  for (const Pixel& pixel : pixels) {
    if (!(pixel.bound > allowed) || !(pixel.shares.sum > 0)) continue;
    PixelDemand demand{allowed, {}};
    for (const auto& [brick, share] : pixel.shares.bricks)
      if (std::isfinite(bounds[brick]) && bounds[brick] > 0)
        demand.slopes.emplace_back(
            brick, static_cast<float>(static_cast<double>(share) * pixel.bound / pixel.shares.sum /
                                      static_cast<double>(bounds[brick])));
    if (!demand.slopes.empty()) demands.push_back(std::move(demand));
  }
  return demands;
}

std::vector<float> PictureRefinement::Impl::ask(const MixedVolume& volume, const Certificate& certificate) {
  views = views_of(wanted, volume);
  const std::vector<float> bounds = bounds_of(certificate);
  const RayField field(volume, bounds, coverage, certificate.roi);
  const std::vector<Pixel> pixels = pixels_of(field);
  PictureRound round;
  round.samples = samples_of(volume);
  for (const Pixel& p : pixels) {
    round.worst = std::max(round.worst, p.bound);
    round.mean += p.bound / static_cast<double>(pixels.size());
    round.over += (p.bound > options.levels ? 1.0 : 0.0) / static_cast<double>(pixels.size());
  }
  // A brick may be finer than it was asked to be, for others beside it, and need not stay so.
  if (loosest.empty()) loosest = bounds;
  for (std::size_t i = 0; i < bounds.size(); ++i) loosest[i] = std::max(loosest[i], bounds[i]);
  std::vector<float> asked;
  if (round.worst > options.levels && static_cast<int>(rounds.size()) < options.most_rounds) {
    const double allowed = std::max(aim * options.levels, round_share * round.worst);
    asked = spend(loosest, demands_of(pixels, bounds, allowed), options.finest_abs);
    for (std::size_t i = 0; i < asked.size(); ++i)
      if (!(asked[i] < loosest[i])) asked[i] = std::numeric_limits<float>::infinity();
    grade_bounds(asked, volume.bricks());
    // What is asked already, and what closing and rounding make of it anyway.
    constexpr float same = 0.98f;
    for (std::size_t i = 0; i < asked.size(); ++i) round.asked += asked[i] < same * bounds[i] ? 1 : 0;
    if (round.asked == 0) asked.clear();
  }
  rounds.push_back(round);
  return asked;
}

PictureRefinement::PictureRefinement(WantedViews views, const ProjectionSet& scan, const FieldOptions& field,
                                     PictureRefinementOptions options, Progress progress)
    : impl_(std::make_unique<Impl>(std::move(views), scan, field, std::move(options), std::move(progress))) {
  if (!(impl_->options.levels > 0 && impl_->options.levels <= 255))
    throw InputError(fmt::format("`picture-tolerance` {} is none of levels of 255: above 0, at most 255",
                                 impl_->options.levels));
}
PictureRefinement::~PictureRefinement() = default;

Refinement PictureRefinement::refinement(double everywhere_abs) {
  return {everywhere_abs,
          [this](const MixedVolume& volume, const Certificate& certificate) {
            return impl_->ask(volume, certificate);
          },
          fmt::format("pictures {} within {:a}", impl_->wanted.sha256, impl_->options.levels)};
}
const std::vector<PictureRound>& PictureRefinement::rounds() const { return impl_->rounds; }
bool PictureRefinement::met() const {
  return !impl_->rounds.empty() && impl_->rounds.back().worst <= impl_->options.levels;
}
const PictureViews& PictureRefinement::views() const { return impl_->views; }

void PictureRefinement::note(Certificate& certificate) const {
  if (impl_->rounds.empty()) return;
  const PictureRound& last = impl_->rounds.back();
  nlohmann::ordered_json options = nlohmann::ordered_json::parse(certificate.options_json);
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array(), points = cameras;
  for (const Camera& c : impl_->views.cameras)
    cameras.push_back({{"position", c.position},
                       {"focal_point", c.focal_point},
                       {"view_up", c.view_up},
                       {"view_angle", c.view_angle_deg}});
  for (const TransferPoint& p : impl_->views.transfer.points)
    points.push_back({{"value", p.value}, {"rgb", p.rgb}, {"opacity", p.opacity}});
  options["pictures"] = {{"levels", impl_->options.levels},
                         {"worst", last.worst},
                         {"met", met()},
                         {"rounds", impl_->rounds.size()},
                         {"views_sha256", impl_->wanted.sha256},
                         {"size", {impl_->views.width, impl_->views.height}},
                         {"transfer", points},
                         {"background", {impl_->views.background_top, impl_->views.background_bottom}},
                         {"cameras", cameras}};
  certificate.options_json = options.dump();
  certificate.notes.push_back(fmt::format(
      "refined for {} view(s): bricks that these do not need are coarse, and epsilon says how coarse",
      impl_->views.cameras.size()));
}

}  // namespace vdvr
