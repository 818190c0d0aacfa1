// Pixels, shares, and what they ask of bricks.
#include "host/picture/refine/picture_rounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/system/parallel.hpp"
#include "host/picture/rays/emission.hpp"
#include "host/picture/refine/shares.hpp"

namespace vdvr {
namespace {

// Of the tolerance: what is aimed at, since shares are no bounds.
constexpr double aim = 0.93;
// Of the worst pixel: what one round aims at. Far from the tolerance shares say little of how far.
constexpr double round_share = 0.4;

struct Pixel {
  double bound = 0;  // levels of 255
  PixelShares shares;
};

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

// Certified bounds beside what V's own picture shows there; shares of those that are above the tolerance.
std::vector<Pixel> pixels_of(const RayField& field, const PictureViews& views, double levels, int parts,
                             const Progress& progress) {
  std::vector<Pixel> pixels;
  const MediumRanges ranges(views.transfer);
  const auto count = static_cast<double>(views.cameras.size());
  for (std::size_t view = 0; view < views.cameras.size(); ++view) {
    const auto report_view = [&](const std::string&, double part) {
      report(progress, "pictures", (static_cast<double>(view) + part) / count);
    };
    std::vector<PixelShares> shares = pixel_shares(field, views, view, parts);
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
        if (pixel.bound > levels) pixel.shares = std::move(shares[i]);
      }
    });
  }
  return pixels;
}

// Shares are scaled so that they add up to the pixel's bound.
std::vector<PixelDemand> demands_of(const std::vector<Pixel>& pixels, const std::vector<float>& bounds,
                                    double allowed) {
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

}  // namespace

std::vector<float> PictureRounds::look(const RayField& field, const PictureViews& views,
                                       const std::vector<float>& bounds, const Index3& bricks,
                                       std::uint64_t samples, const Progress& progress) {
  const std::vector<Pixel> pixels = pixels_of(field, views, options_.levels, parts_, progress);
  PictureRound round;
  round.samples = samples;
  for (const Pixel& p : pixels) {
    round.worst = std::max(round.worst, p.bound);
    round.mean += p.bound / static_cast<double>(pixels.size());
    round.over += (p.bound > options_.levels ? 1.0 : 0.0) / static_cast<double>(pixels.size());
  }
  // A brick may be finer than it was asked to be, for others beside it, and need not stay so.
  if (loosest_.empty()) loosest_ = bounds;
  for (std::size_t i = 0; i < bounds.size(); ++i) loosest_[i] = std::max(loosest_[i], bounds[i]);
  std::vector<float> asked;
  if (round.worst > options_.levels && static_cast<int>(rounds_.size()) < options_.most_rounds) {
    const double allowed = std::max(aim * options_.levels, round_share * round.worst);
    asked = spend(loosest_, demands_of(pixels, bounds, allowed), options_.finest_abs);
    for (std::size_t i = 0; i < asked.size(); ++i)
      if (!(asked[i] < loosest_[i])) asked[i] = std::numeric_limits<float>::infinity();
    grade_bounds(asked, bricks);
    // What is asked already, and what closing and rounding make of it anyway.
    constexpr float same = 0.98f;
    for (std::size_t i = 0; i < asked.size(); ++i) round.asked += asked[i] < same * bounds[i] ? 1U : 0U;
    if (round.asked == 0) asked.clear();
  }
  rounds_.push_back(round);
  return asked;
}

}  // namespace vdvr
