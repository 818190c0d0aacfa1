#include "host/certify/sampler_share.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/bounds/result_units.hpp"

namespace vdvr {
namespace {

// What is reserved may be short of what the volume takes that was brought within it.
constexpr double reserve = 1.25;
// How often a volume may be brought within a smaller tolerance, and how often begun anew for it.
constexpr int most_times = 4, most_begun_anew = 3;

double worse_of(const SamplerTerms& sampler) {
  return std::max(sampler.buffer.value, sampler.image3d ? sampler.image3d->value : 0.0);
}

}  // namespace

SamplerShare::SamplerShare(const std::vector<Crew::Kind>& kinds, const Plan& plan, const Units& units,
                           double epsilon_abs, double arithmetic, const FieldSlopes& base, bool buffer_alone)
    : kinds_(kinds),
      plan_(plan),
      units_(units),
      epsilon_abs_(epsilon_abs),
      arithmetic_(arithmetic),
      charges_(plan.settings.comparison.terms != Terms::grid) {
  for (const Crew::Kind& kind : kinds) {
    SamplerTerms sampler = terms(kind, base, longest_atlas(kind.info));
    const bool coarse = sampler.image3d && (!kind.probe.weighs_in_fp32() || buffer_alone);
    if (coarse) sampler.image3d.reset();
    coarse_ = coarse_ || coarse;
    reserved_ = std::max(reserved_, reserve * worse_of(sampler));
  }
  start_ = first_tolerance(epsilon_abs);
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
  for (std::size_t i = 1; i < kinds_.size(); ++i) {
    const SamplerTerms other = terms_of(kinds_[i]);
    if (other.buffer.value > worst.buffer.value) worst.buffer = other.buffer;
    if (other.image3d && (!worst.image3d || other.image3d->value > worst.image3d->value))
      worst.image3d = other.image3d;
  }
  return worst;
}

double SamplerShare::beside_nodes(const SamplerTerms& sampler, double tolerance) const {
  if (!charges_) return 0;
  const double worse = arithmetic_ + worse_of(sampler);
  return worse <= tolerance / 8 ? worse : arithmetic_ + sampler.buffer.value;
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

double SamplerShare::begin() {
  times_ = 0;
  anew_ = false;
  return now_ = start_;
}

std::optional<double> SamplerShare::smaller(const Certificate& measured) {
  const SamplerTerms& sampler = measured.budget.sampler;
  const bool image3d = wants_image3d_ && !measured.holds_image3d.value_or(true);
  if ((measured.holds_buffer && !image3d) || measured.comparison) return std::nullopt;
  if (!image3d) {
    if (times_++ == most_times) return std::nullopt;
    return now_ = left_or_throw(reserve * sampler.buffer.value, epsilon_abs_);
  }
  raised_for_image3d_ = true;
  if (coarse_) {
    // Steps between samples shrink with what is refined, and the unit's share of them: where it seems to take
    // all, half is tried.
    const double beside = left(sampler.image3d->value, epsilon_abs_);
    const bool anew = begun_anew_ == 0 || beside < now_ / 2;
    now_ = std::max(beside, now_ / 2);
    if (anew && begun_anew_++ < most_begun_anew) {
      anew_ = true;
      start_ = now_;
      return std::nullopt;
    }
  } else {
    now_ = left_or_throw(reserve * sampler.image3d->value, epsilon_abs_);
  }
  if (times_++ == most_times)
    throw NoRoomForImage3d(fmt::format("the texture unit may err by {:.4g} of epsilon {:.4g}",
                                       to_world(sampler.image3d->value, units_),
                                       to_world(epsilon_abs_, units_)));
  return now_;
}

void SamplerShare::give_up_image3d() {
  wants_image3d_ = raised_for_image3d_ = false;
  start_ = first_tolerance(epsilon_abs_);
}

}  // namespace vdvr
