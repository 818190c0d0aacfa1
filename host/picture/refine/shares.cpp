// T |q(s) - q(v) - (tau(s) - tau(v)) W| at its largest over |s - v| <= e, added up along rays: q = tau c, T
// the transmittance in front, W the colour behind.
#include "host/picture/refine/shares.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "host/base/system/parallel.hpp"
#include "host/picture/rays/emission.hpp"

namespace vdvr {
namespace {

using Colour = std::array<double, 3>;

/// Of a value: extinction per base cell, and emission.
struct Medium {
  double tau = 0;
  Colour emission{};
};

class Media {
 public:
  explicit Media(const TransferFunction& transfer) : points_(transfer.points) {
    low_ = points_.front().value;
    high_ = points_.back().value;
    for (int i = 0; i <= bins; ++i) table_.push_back(exact(low_ + (high_ - low_) * i / bins));
  }
  [[nodiscard]] const Medium& at(double value) const {
    const double place = (value - low_) / (high_ - low_) * bins;
    return table_[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(bins)) + 0.5)];
  }
  /// Calls visit for values from v - e to v + e, ends and control points included.
  template <class Visit>
  void around(double v, double e, Visit&& visit) const {
    constexpr int parts = 12;
    const double low = std::max(v - e, low_), high = std::min(v + e, high_);
    if (!(low <= high)) return visit(at(v < low_ ? low_ : high_));
    for (int i = 0; i <= parts; ++i) visit(at(low + (high - low) * i / parts));
    for (const TransferPoint& p : points_)
      if (p.value > low && p.value < high) visit(at(p.value));
  }

 private:
  static constexpr int bins = 4096;
  [[nodiscard]] Medium exact(double value) const {
    // An opaque value: thicker than any picture tells.
    constexpr double opaque = 0.99999;
    const TransferPoint p = transfer_at(points_, value);
    Medium m{-std::log1p(-std::min(p.opacity, opaque)), {}};
    for (std::size_t c = 0; c < 3; ++c) m.emission[c] = m.tau * p.rgb[c];
    return m;
  }

  std::vector<TransferPoint> points_;
  std::vector<Medium> table_;
  double low_ = 0, high_ = 1;
};

struct Sample {
  double value, cells, bound;
  std::uint32_t brick;
};

std::vector<Sample> samples_along(const RayField& field, const WorldRay& ray, const Media& media, int parts) {
  std::vector<Sample> out;
  double depth = 0;
  // What lies behind this is seen by less than a tenth of a level.
  constexpr double dark = 8;
  field.walk(ray, [&](const RayPiece& piece) {
    const double cells = (piece.last - piece.first) / field.cell() / parts;
    for (int i = 0; i < parts; ++i) {
      const double middle = (i + 0.5) / parts, value = part_of(piece.value, middle, middle)[0];
      out.push_back({value, cells, piece.bound, static_cast<std::uint32_t>(piece.brick)});
      depth += cells * media.at(value).tau;
    }
    return depth < dark;
  });
  return out;
}

PixelShares added(const std::vector<Sample>& samples, const Media& media, Colour behind) {
  double depth = 0;
  for (const Sample& s : samples) depth += s.cells * media.at(s.value).tau;
  std::map<std::uint32_t, Colour> by_brick;
  Colour sum{};
  for (auto s = samples.rbegin(); s != samples.rend(); ++s) {
    const Medium& own = media.at(s->value);
    depth -= s->cells * own.tau;
    Colour most{};
    media.around(s->value, s->bound, [&](const Medium& other) {
      for (std::size_t c = 0; c < 3; ++c)
        most[c] = std::max(most[c],
                           std::abs(other.emission[c] - own.emission[c] - (other.tau - own.tau) * behind[c]));
    });
    Colour& brick = by_brick[s->brick];
    const double kept = std::exp(-s->cells * own.tau), weight = 255 * std::exp(-depth) * s->cells;
    for (std::size_t c = 0; c < 3; ++c) {
      brick[c] += weight * most[c];
      sum[c] += weight * most[c];
      behind[c] = kept * behind[c] + (own.tau > 0 ? (1 - kept) * own.emission[c] / own.tau : 0);
    }
  }
  const auto channel = static_cast<std::size_t>(std::max_element(sum.begin(), sum.end()) - sum.begin());
  PixelShares out{sum[channel], behind, {}};
  for (const auto& [brick, share] : by_brick)
    if (share[channel] > 0) out.bricks.emplace_back(brick, static_cast<float>(share[channel]));
  return out;
}

}  // namespace

std::array<double, 3> background_of(const PictureViews& views, std::int64_t y) {
  const double part = views.height > 1 ? static_cast<double>(y) / static_cast<double>(views.height - 1) : 0;
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = (1 - part) * views.background_top[c] + part * views.background_bottom[c];
  return out;
}

std::vector<PixelShares> pixel_shares(const RayField& field, const PictureViews& views, std::size_t view,
                                      int parts, const Progress& progress) {
  const Media media(views.transfer);
  std::vector<PixelShares> out(static_cast<std::size_t>(views.width * views.height));
  parallel_for(views.height, progress, "shares", [&](std::int64_t y) {
    const Colour background = background_of(views, y);
    for (std::int64_t x = 0; x < views.width; ++x) {
      const WorldRay ray = pixel_ray(views.cameras[view], views.width, views.height, x, y);
      out[static_cast<std::size_t>(y * views.width + x)] =
          added(samples_along(field, ray, media, parts), media, background);
    }
  });
  return out;
}

}  // namespace vdvr
