#include "host/certify/sampler_share.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdvr {
namespace {

// What is reserved may be short of what the volume takes that was brought within it.
constexpr double reserve = 1.25;
// How often a volume may be brought within a smaller tolerance: of all bricks, and where each has its own,
// which rises by a level at a time.
constexpr int most_times = 4, most_times_by_brick = 16;

double worse_of(const SamplerTerms& sampler) {
  return std::max(sampler.buffer.value, sampler.image3d ? sampler.image3d->value : 0.0);
}

// How far |V - gold| may lie from 0 on finer samples, so that there is room for the unit beside it. Steps,
// and with them what the unit takes, fall with the spacing of samples, |V - gold| with its square: error x^2
// + image x = left.
double beside_finer(double error, double image, double left) {
  const double x = 2 * left / (image + std::sqrt(image * image + 4 * error * left));
  return error * x * x;
}

}  // namespace

SamplerShare::SamplerShare(const std::vector<Crew::Kind>& kinds, const Plan& plan, const Units& units,
                           double epsilon_abs, double arithmetic, const FieldSlopes& base,
                           std::vector<double> bounds)
    : kinds_(kinds),
      plan_(plan),
      units_(units),
      epsilon_abs_(epsilon_abs),
      arithmetic_(arithmetic),
      bounds_(std::move(bounds)),
      charges_(plan.settings.comparison.terms != Terms::grid) {
  for (const Crew::Kind& kind : kinds) {
    SamplerTerms sampler = terms(kind, base, longest_atlas(kind.info));
    const bool coarse = sampler.image3d && !kind.probe.weighs_in_fp32();
    if (coarse || !bounds_.empty()) sampler.image3d.reset();
    coarse_ = coarse_ || coarse;
    reserved_ = std::max(reserved_, reserve * worse_of(sampler));
  }
  start_ = NodeTolerance(first_tolerance(epsilon_abs));
}

SamplerTerms SamplerShare::terms(const Crew::Kind& kind, const FieldSlopes& slopes,
                                 std::int64_t atlas) const {
  return sampler_terms(slopes, plan_.grid, kind.probe, atlas, epsilon_abs_, plan_.rates.gold,
                       from_world(sampler_underflow(kind.info), units_));
}

SamplerTerms SamplerShare::of(const MixedVolume& volume) const {
  const FieldSlopes slopes = field_slopes(volume);
  const auto terms_of = [&](const Crew::Kind& kind) {
    return terms(kind, slopes, atlas_length(kind.info, volume));
  };
  SamplerTerms worst = terms_of(kinds_.front());
  for (std::size_t k = 1; k < kinds_.size(); ++k) {
    SamplerTerms other = terms_of(kinds_[k]);
    if (other.buffer.value > worst.buffer.value) worst.buffer = other.buffer;
    if (!other.image3d) continue;
    if (!worst.image3d || other.image3d->value > worst.image3d->value) {
      worst.image3d = other.image3d;
      std::swap(worst.image3d_by_brick, other.image3d_by_brick);
    }
    for (std::size_t i = 0; i < other.image3d_by_brick.size(); ++i)
      worst.image3d_by_brick[i] = std::max(worst.image3d_by_brick[i], other.image3d_by_brick[i]);
  }
  return worst;
}

double SamplerShare::beside_nodes(const SamplerTerms& sampler) const {
  if (!charges_) return 0;
  return arithmetic_ + (coarse_ && !bounds_.empty() ? sampler.buffer.value : worse_of(sampler));
}

double SamplerShare::room_of(std::size_t brick) const {
  return left(0, bounds_.empty() ? epsilon_abs_ : std::min(epsilon_abs_, bounds_[brick]));
}

bool SamplerShare::has_room_for_image3d(const Certificate& measured) const {
  if (!coarse_ || !measured.total_image3d) return measured.holds_image3d.value_or(true);
  for (std::size_t i = 0; i < measured.brick_totals.size(); ++i)
    if (const auto total = static_cast<double>(measured.brick_totals[i]);
        total >= 0 && total + static_cast<double>(measured.budget.sampler.image3d_by_brick[i]) > room_of(i))
      return false;
  return true;
}

double SamplerShare::left(double taken, double epsilon_abs) const {
  return charges_ ? epsilon_abs - arithmetic_ - taken : epsilon_abs;
}

double SamplerShare::left_or_throw(double taken, double epsilon_abs) const {
  const double tolerance = left(taken, epsilon_abs);
  if (tolerance > 0) return tolerance;
  throw ToleranceError(fmt::format("epsilon {:.4g} is out of reach: rounding and samplers alone take {:.4g}",
                                   to_world(epsilon_abs, units_), to_world(arithmetic_ + taken, units_)));
}

double SamplerShare::first_tolerance(double epsilon_abs) const {
  return left_or_throw(reserved_, epsilon_abs);
}

NodeTolerance SamplerShare::begin() {
  times_ = 0;
  anew_ = false;
  now_ = start_.of_all;
  return start_;
}

std::optional<NodeTolerance> SamplerShare::smaller(const Certificate& measured,
                                                   const std::vector<BrickMeasure>& bricks) {
  const SamplerTerms& sampler = measured.budget.sampler;
  const bool image3d = wants_image3d_ && !has_room_for_image3d(measured);
  if ((measured.holds_buffer && !image3d) || measured.comparison) return std::nullopt;
  if (!image3d) {
    if (times_++ == most_times) return std::nullopt;
    return now_ = left_or_throw(reserve * sampler.buffer.value, epsilon_abs_);
  }
  raised_for_image3d_ = true;
  if (times_++ == (coarse_ ? most_times_by_brick : most_times))
    throw NoRoomForImage3d(fmt::format("the texture unit may err by {:.4g} of epsilon {:.4g}",
                                       to_world(sampler.image3d->value, units_),
                                       to_world(epsilon_abs_, units_)));
  if (coarse_) return smaller_for_coarse(measured, bricks);
  return now_ = left_or_throw(reserve * sampler.image3d->value, epsilon_abs_);
}

// Bricks that the unit's own share takes beyond epsilon. Begun anew they are classified beside what it will
// take of finer samples; what still is beyond rises.
std::optional<NodeTolerance> SamplerShare::smaller_for_coarse(const Certificate& measured,
                                                              const std::vector<BrickMeasure>& bricks) {
  const std::vector<float>& images = measured.budget.sampler.image3d_by_brick;
  NodeTolerance tolerance(now_, std::vector<float>(bricks.size(), std::numeric_limits<float>::infinity()));
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    const auto total = static_cast<double>(measured.brick_totals[i]), image = static_cast<double>(images[i]);
    const double all = room_of(i);
    if (total < 0 || total + image <= all) continue;
    const auto slack = static_cast<double>(bricks[i].slack);
    const double error = std::max(total - slack, 0.0), room = std::max(all - slack, 0.0);
    // What is to rise errs by more than it may.
    const double within = begun_anew_ ? std::max(room - image, error / 2) : beside_finer(error, image, room);
    tolerance.by_brick[i] = static_cast<float>(slack + within);
  }
  if (begun_anew_) return tolerance;
  begun_anew_ = anew_ = true;
  start_ = std::move(tolerance);
  return std::nullopt;
}

void SamplerShare::give_up_image3d() {
  wants_image3d_ = raised_for_image3d_ = false;
  start_ = NodeTolerance(first_tolerance(epsilon_abs_));
}

}  // namespace vdvr
