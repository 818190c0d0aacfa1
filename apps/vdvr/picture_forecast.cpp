#include "apps/vdvr/picture_forecast.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/vdvr/output.hpp"

namespace vdvr::cli {

std::optional<PictureForecast> picture_forecast(Device& device, const Planned& planned, const Wanted& wanted,
                                                const Progress& progress) {
  if (!planned.made.pictures) return std::nullopt;
  return forecast_pictures(device, planned.scan, planned.made.plan, planned.made.asked.pictures->views,
                           planned.made.refinement_options(), planned.made.everywhere_abs(),
                           wanted.options.build.storage, progress);
}

Json forecast_json(const PictureForecast& f, const Plan& plan) {
  Json rounds = Json::array();
  for (const PictureRound& r : f.rounds)
    rounds.push_back(
        {{"worst", r.worst}, {"mean", r.mean}, {"over", r.over}, {"samples", r.samples}, {"asked", r.asked}});
  return {{"samples_ratio", f.samples_ratio},
          {"samples", f.samples_ratio * static_cast<double>(plan.grid.sample_count())},
          {"bytes", f.bytes},
          {"memory_bytes", f.memory_bytes},
          {"seconds", f.seconds},
          {"bounds", {{"least", f.least}, {"median", f.median}, {"largest", f.largest}}},
          {"rounds", rounds}};
}

void print_forecast(const PictureForecast& f, const Plan& plan) {
  const PictureRound& last = f.rounds.back();
  fmt::print(
      "foreseen       {:.3f} samples stored per base sample, {} before compression, {} of memory, {:.1f} s\n",
      f.samples_ratio, bytes_text(f.bytes), bytes_text(f.memory_bytes), f.seconds);
  const auto part = [&](double bound) { return 100 * bound / plan.reference_range; };
  fmt::print(
      "  bricks       |V - F| at most {:.3g}, {:.3g}, {:.3g} % of the range (least, median, largest)\n",
      part(f.least), part(f.median), part(f.largest));
  fmt::print("  pictures     worst pixel {:.1f} levels, mean {:.2f}, {} rounds from {:.1f}\n", last.worst,
             last.mean, f.rounds.size(), f.rounds.front().worst);
}

}  // namespace vdvr::cli
