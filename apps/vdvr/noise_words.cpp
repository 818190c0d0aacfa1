#include "apps/vdvr/noise_words.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"

namespace vdvr::cli {
namespace {

constexpr std::array<double, 2> multiples{1, 2};

Json number_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

}  // namespace

Json noise_json(const NoiseFound& found) {
  if (!found.noise) return {{"found", false}, {"why", found.why}};
  const ScanNoise& n = *found.noise;
  return {{"found", true},
          {"source", n.model.source},
          {"photons", n.model.photons > 0 ? Json(n.model.photons) : Json()},
          {"sigma_p", n.model.constant > 0 ? Json(std::sqrt(n.model.constant)) : Json()},
          {"by_flats", number_or_null(n.by_flats)},
          {"by_differences", number_or_null(n.by_differences)},
          {"by_wedge", number_or_null(n.by_wedge)},
          {"agreed", n.agreed},
          {"passed", n.passed}};
}

void print_noise(const NoiseFound& found) {
  fmt::print("  noise        {}\n", found.noise ? found.noise->words : "not known: " + found.why);
}

std::optional<FieldNoise> noise_of_plan(Device& device, const Planned& planned, const Progress& progress) {
  if (!planned.noise.noise || !planned.made.sigma) return std::nullopt;
  const Plan& plan = planned.made.plan;
  FieldNoise out;
  out.sigma = planned.made.sigma->range;
  out.sigmas = planned.made.asked.sigmas;
  out.split = split_of_views(device, planned.scan, plan.field, planned.noise.noise->model, progress);
  out.forecasts = forecast_in_sigma(plan, *planned.made.sigma, multiples);
  for (SigmaForecast& one : out.forecasts)  // of more bricks
    if (out.sigmas && one.multiple == *out.sigmas) one.samples_ratio = plan.samples_ratio;
  out.rings = ring_noise(planned.scan, planned.understood.flats);
  return out;
}

Json field_noise_json(const FieldNoise& noise, const Plan& plan) {
  Json json = {
      {"sigma",
       {{"least", noise.sigma.least}, {"median", noise.sigma.median}, {"largest", noise.sigma.largest}}},
      {"epsilon_in_sigma", noise.sigmas ? *noise.sigmas : plan.epsilon_abs / noise.sigma.median},
      {"split", Json()},
      {"foreseen", Json::array()}};
  if (noise.split)
    json["split"] = {{"sigma", noise.split->sigma},
                     {"predicted", noise.split->predicted},
                     {"ratio", noise.split->ratio()},
                     {"resolved", noise.split->resolved}};
  if (noise.rings)
    json["rings"] = {{"flats", noise.rings->flats},
                     {"at_axis", noise.rings->at_axis},
                     {"slope", noise.rings->slope},
                     {"radius", noise.rings->radius()}};
  for (const SigmaForecast& f : noise.forecasts)
    json["foreseen"].push_back({{"sigmas", f.multiple}, {"samples_ratio", f.samples_ratio}});
  return json;
}

void print_field_noise(const FieldNoise& noise, const Plan& plan) {
  const double median = noise.sigma.median;
  fmt::print("noise of F     sigma {:.4g} ({:.4g} to {:.4g}), {:.3g} % of the range; an estimate\n", median,
             noise.sigma.least, noise.sigma.largest, 100 * median / plan.reference_range);
  if (noise.split)
    fmt::print("  split        {}\n", split_words(noise.split->ratio(), noise.split->resolved));
  else fmt::print("  split        too few views to be split for comparison\n");
  if (noise.rings && noise.rings->radius() > 1)
    fmt::print(
        "  rings        noise of the {} flats, the same in all views, adds more than a tenth to sigma^2 "
        "within {:.0f} "
        "columns of the axis\n",
        noise.rings->flats, noise.rings->radius());
  if (noise.sigmas) fmt::print("  tolerance    {:g} sigma of its own in each brick\n", *noise.sigmas);
  else fmt::print("  tolerance    epsilon is {:.2f} sigma\n", plan.epsilon_abs / median);
  for (const SigmaForecast& f : noise.forecasts)
    fmt::print(
        "  {:g} sigma      {:.3g} % of the range in the middle: {:.3f} samples per base sample foreseen "
        "before repair, brick by brick\n",
        f.multiple, 100 * f.multiple * median / plan.reference_range, f.samples_ratio);
}

}  // namespace vdvr::cli
