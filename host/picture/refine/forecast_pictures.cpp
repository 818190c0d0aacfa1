// Rounds of refinement without a build: pictures of F within the bounds that bricks are foreseen to have.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/certify/forecaster.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/picture/refine/brick_forecast.hpp"
#include "host/picture/refine/picture_rounds.hpp"
#include "host/volume/sampler/sampler_terms.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/picture_refinement.hpp"

namespace vdvr {
namespace {

// Of a picture with more pixels every second one is looked at, along x and y.
constexpr std::int64_t most_pixels = 64 * 64;

// F on the grid has cells as large as the grid's where the volume's will be smaller: with two values a cell
// the colour itself would err by more than the tolerance.
constexpr int parts_a_cell = 12;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::uint64_t bytes_of(SampleType type) {
  return type == SampleType::u8 ? 1 : type == SampleType::u16 ? 2 : 4;
}

// Where a brick's bound of |V - F| comes from.
struct Tolerances {
  double everywhere, least;  // of nodes
  double rest;               // beside nodes
  std::vector<float> by_brick;

  [[nodiscard]] double of(std::size_t brick) const {
    return std::min(everywhere, static_cast<double>(by_brick[brick]));
  }
  // As a build takes what is asked; whether that is news to a brick.
  bool take(const std::vector<float>& asked, const std::vector<float>& bounds) {
    bool more = false;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const auto tolerance = static_cast<float>(std::max(static_cast<double>(asked[i]) - rest, least));
      if (!(tolerance < by_brick[i])) continue;
      by_brick[i] = tolerance;
      more = more || static_cast<double>(bounds[i]) - rest > static_cast<double>(tolerance);
    }
    return more;
  }
};

class PictureForecaster {
 public:
  PictureForecaster(Device& device, const ProjectionSet& scan, const Plan& plan, const WantedViews& wanted,
                    const PictureRefinementOptions& options, double everywhere_abs, const Progress& progress)
      : state_(device.state()),
        plan_(plan),
        forecaster_(*plan.forecaster),
        progress_(progress),
        host_(state_),
        coverage_(certified_coverage(scan, plan.field)),
        filters_(filter_errors(probe_filters(device))),
        rounds_(options, parts_a_cell) {
    host_.count(4 * count(std::ssize(plan.base.samples)) + BrickForecast::bytes(plan.grid, plan.layout),
                "pictures foreseen");
    GoldSettings shape{plan.grid, plan.layout.granularity};
    volume_ = as_mixed(plan.base.samples, shape);
    full_ = views_of(wanted, volume_);
    views_ = full_;
    if (views_.width * views_.height > most_pixels) {
      views_.width = (views_.width + 1) / 2;
      views_.height = (views_.height + 1) / 2;
    }
    const SamplerTerms sampler =
        sampler_terms(field_slopes(volume_), plan.grid, probe_filters(device), longest_atlas(device.info()),
                      everywhere_abs, plan.rates.gold, sampler_underflow(device.info()));
    const double rest = plan.budget.arithmetic.value +
                        std::max(sampler.buffer.value, sampler.image3d ? sampler.image3d->value : 0.0);
    tolerances_ = {everywhere_abs - rest, std::max(plan.epsilon_abs - rest, 0.0), rest,
                   std::vector<float>(forecaster_.near().size(), std::numeric_limits<float>::infinity())};
    bricks_.emplace(plan.base, plan.layout, plan.rates.gold,
                    plan.budget.projection.value + plan.budget.gold.value);
    bricks_->compare(forecaster_.measured());
  }

  PictureForecast make(StorageChoice storage) {
    std::vector<float> bounds;
    double pictures = 0;
    for (;;) {
      Samples samples = look_ahead(bounds);
      closing_ = static_cast<double>(samples.closed) / static_cast<double>(samples.open);
      const auto start = std::chrono::steady_clock::now();
      const RayField field(volume_, bounds, coverage_);
      const std::vector<float> asked =
          rounds_.look(field, views_, bounds, bricks_->bricks(), samples.closed, progress_);
      pictures += seconds_since(start);
      raises_.push_back(std::move(samples.raises));
      if (asked.empty() || !tolerances_.take(asked, bounds)) break;
    }
    PictureForecast out;
    out.rounds = rounds_.rounds();
    say_bounds(bounds, out);
    const double pixels =
        static_cast<double>(full_.width * full_.height) / static_cast<double>(views_.width * views_.height);
    forecast_last(storage, pictures * pixels, out);
    return out;
  }

 private:
  struct Samples {
    std::uint64_t open = 0, closed = 0;
    std::vector<std::uint8_t> raises;  // by brick: levels that closing adds
  };
  // Bounds of the bricks as asked so far; the samples that they take before closing and after it.
  Samples look_ahead(std::vector<float>& bounds) const {
    const std::vector<std::uint8_t>& near = forecaster_.near();
    std::vector<BrickForecast::Level> own(near.size());
    for (std::size_t i = 0; i < near.size(); ++i)
      if (near[i]) own[i] = bricks_->level(i, tolerances_.of(i));
    const std::vector<BrickForecast::Level> closed = bricks_->closed(own);
    const std::uint64_t base = forecaster_.stored();
    Samples samples{base, base, std::vector<std::uint8_t>(near.size(), 0)};
    bounds.assign(near.size(), std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (!near[i]) continue;
      bounds[i] = static_cast<float>(bricks_->error(i, closed[i]) + tolerances_.rest);
      samples.open += bricks_->samples(own[i]);
      samples.closed += bricks_->samples(closed[i]);
      for (std::size_t a = 0; a < 3; ++a)
        samples.raises[i] = std::max(samples.raises[i], static_cast<std::uint8_t>(closed[i][a] - own[i][a]));
    }
    return samples;
  }

  static void say_bounds(std::vector<float> bounds, PictureForecast& out) {
    std::erase_if(bounds, [](float b) { return !std::isfinite(b); });
    if (bounds.empty()) return;
    std::sort(bounds.begin(), bounds.end());
    out.least = static_cast<double>(bounds.front());
    out.median = static_cast<double>(bounds[bounds.size() / 2]);
    out.largest = static_cast<double>(bounds.back());
  }

  // Storage and time at the tolerances of the last round, by what some bricks need.
  void forecast_last(StorageChoice storage, double pictures, PictureForecast& out) {
    const BuildForecast build = forecaster_.forecast({tolerances_.everywhere, tolerances_.by_brick});
    out.samples_ratio = closing_ * build.samples_ratio;
    const auto more = static_cast<double>(out.rounds.size() - 1);
    out.seconds = plan_.seconds + more * (build.seconds - build.kept_seconds) + pictures;
    for (const auto& raises : raises_) out.seconds += forecaster_.repair_seconds(raises);
    out.bytes =
        static_cast<std::uint64_t>(out.samples_ratio * static_cast<double>(plan_.grid.sample_count())) *
        bytes_of(forecaster_.lattice(plan_, storage, filters_).base);
    const auto tiles = [&](std::uint64_t bytes) {
      return memory_of_tiles(bytes, state_.memory.limit(), state_.info.is_gpu);
    };
    out.memory_bytes = plan_.memory_bytes - tiles(plan_.tile_bytes) +
                       tiles(static_cast<std::uint64_t>(closing_ * static_cast<double>(build.tile_bytes)));
  }

  opencl::State& state_;
  const Plan& plan_;
  Forecaster& forecaster_;
  const Progress& progress_;
  HostMemory host_;
  Coverage coverage_;
  FilterErrors filters_;
  PictureRounds rounds_;
  MixedVolume volume_;  // F at the grid's samples
  PictureViews full_, views_;
  Tolerances tolerances_{};
  std::optional<BrickForecast> bricks_;
  std::vector<std::vector<std::uint8_t>> raises_;  // by round
  double closing_ = 1;                             // times the samples, in the last round
};

}  // namespace

PictureForecast forecast_pictures(Device& device, const ProjectionSet& scan, const Plan& plan,
                                  const WantedViews& wanted, const PictureRefinementOptions& options,
                                  double everywhere_abs, StorageChoice storage, const Progress& progress) {
  if (!plan.forecaster)
    throw InputError("pictures are foreseen from a plan of the whole scan that foresees storage and time");
  return PictureForecaster(device, scan, plan, wanted, options, everywhere_abs, progress).make(storage);
}

}  // namespace vdvr
