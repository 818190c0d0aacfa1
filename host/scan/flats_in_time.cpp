#include "host/scan/flats_in_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/base/system/casts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

void require_currents(const io::BeamInTime& beam, const std::vector<double>& currents, const char* what) {
  for (std::size_t k = 0; k < currents.size(); ++k)
    if (!(currents[k] > 0) || !std::isfinite(currents[k]))
      throw InputError(fmt::format(
          "{}: the beam's current is {} in {} {}; it must be positive where frames are divided by "
          "it; `beam_current` none leaves it out",
          beam.currents, currents[k], what, k));
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

std::vector<std::vector<std::int64_t>> runs_of_flats(const io::RawScan& raw) {
  const io::BeamInTime& beam = raw.beam_in_time;
  std::vector<std::int64_t> order(at(raw.flats.count));
  std::iota(order.begin(), order.end(), std::int64_t{0});
  if (beam.flats_at.empty() || beam.projections_at.empty()) return {order};
  const auto place = [&](std::int64_t flat) { return beam.flats_at[at(flat)]; };
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return place(a) < place(b); });
  std::vector<double> projections = beam.projections_at;
  std::sort(projections.begin(), projections.end());
  const auto seen_before = [&](std::int64_t flat) {
    return std::upper_bound(projections.begin(), projections.end(), place(flat));
  };
  std::vector<std::vector<std::int64_t>> runs;
  for (const std::int64_t flat : order) {
    if (runs.empty() || seen_before(runs.back().back()) != seen_before(flat)) runs.emplace_back();
    runs.back().push_back(flat);
  }
  return runs;
}

FlatsInTime::FlatsInTime(const io::RawScan& raw, const Preparation& wanted) : raw_(raw) {
  const io::BeamInTime& beam = raw.beam_in_time;
  const bool frames = raw.counts && !raw.flat_level && raw.flats.count > 0;
  const bool ordered = frames && !beam.flats_at.empty() && !beam.projections_at.empty();
  if (wanted.flats_in_time.value_or(false) && !ordered)
    throw InputError(
        "flats in time: nothing says when the flats were taken; NXtomo has the order of frames, 'flats_at' "
        "of "
        "scan.json states it");
  if (wanted.beam_current.value_or(false) && (!frames || beam.flat_currents.empty()))
    throw InputError(
        "beam current: the scan's files do not have it for projections and flats; 'beam_current' of "
        "scan.json "
        "states it");
  by_current_ = frames && wanted.beam_current.value_or(true) && !beam.flat_currents.empty();
  if (by_current_) {
    require_currents(beam, beam.projection_currents, "projection");
    require_currents(beam, beam.flat_currents, "flat");
    mean_current_ = mean_of(beam.flat_currents);
  }
  if (!frames) return;
  std::vector<std::vector<std::int64_t>> runs = runs_of_flats(raw);
  in_time_ = ordered && wanted.flats_in_time.value_or(true) && runs.size() > 1;
  if (!in_time_) {
    if (!by_current_) return;
    std::vector<std::int64_t> all(at(raw.flats.count));
    std::iota(all.begin(), all.end(), std::int64_t{0});
    runs = {std::move(all)};
  }
  for (std::vector<std::int64_t>& flats : runs) {
    double place = 0;
    if (in_time_)
      for (const std::int64_t flat : flats)
        place += beam.flats_at[at(flat)] / static_cast<double>(flats.size());
    runs_.push_back({std::move(flats), place});
  }
}

std::vector<std::string> FlatsInTime::record(Preparation& recorded) const {
  recorded.flats_in_time = recorded.beam_current = {};
  std::vector<std::string> words;
  if (in_time_) {
    recorded.flats_in_time = true;
    words.push_back(fmt::format(
        "flats in time: {} flats in {} runs, the first {} {:g} frames, the last {} {:g} frames after "
        "the first projection; each projection is divided by what lies between the runs around it; "
        "`flats_in_time` off takes the mean of all",
        raw_.flats.count, runs_.size(), runs_.front().flats.size(),
        runs_.front().at - raw_.beam_in_time.projections_at.front(), runs_.back().flats.size(),
        runs_.back().at - raw_.beam_in_time.projections_at.front()));
  }
  if (by_current_) {
    recorded.beam_current = true;
    const auto& currents = raw_.beam_in_time.projection_currents;
    const auto [low, high] = std::minmax_element(currents.begin(), currents.end());
    words.push_back(
        fmt::format("beam current: projections and flats are divided by {}, which is {:g} to {:g} in "
                    "projections and {:g} on the average of the flats; `beam_current` none leaves it out",
                    raw_.beam_in_time.currents, *low, *high, mean_current_));
  }
  return words;
}

std::uint64_t FlatsInTime::bytes(std::int64_t views) const {
  const auto most = std::min(static_cast<std::uint64_t>(views) + 1, static_cast<std::uint64_t>(runs_.size()));
  return most * static_cast<std::uint64_t>(raw_.rows * raw_.columns) * sizeof(double);
}

FlatsInTime::Between FlatsInTime::between(std::int64_t view) const {
  if (!in_time_) return {};
  const double place = raw_.beam_in_time.projections_at[at(view)];
  const auto next = std::find_if(runs_.begin(), runs_.end(), [&](const Run& r) { return r.at > place; });
  const auto after = static_cast<std::size_t>(next - runs_.begin());
  if (after == 0) return {0, 0, 0};
  if (after == runs_.size()) return {after - 1, after - 1, 0};
  const double from = runs_[after - 1].at;
  return {after - 1, after, (place - from) / (runs_[after].at - from)};
}

std::vector<double> FlatsInTime::gain_of(const Run& run, const std::vector<double>& dark) const {
  std::vector<double> sum(dark.size()), frame(dark.size());
  for (const std::int64_t flat : run.flats) {
    raw_.flats.read(flat, 1, frame.data());
    const double scale = by_current_ ? mean_current_ / raw_.beam_in_time.flat_currents[at(flat)] : 1.0;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += scale * (frame[i] - dark[i]);
  }
  for (double& s : sum) s /= static_cast<double>(run.flats.size());
  return sum;
}

void FlatsInTime::go_to(std::int64_t first, std::int64_t n, const std::vector<double>& dark) {
  std::map<std::size_t, std::vector<double>> needed;
  for (std::int64_t k = first; k < first + n; ++k) {
    const Between b = between(k);
    needed[b.before], needed[b.after];
  }
  for (auto& [run, gain] : needed) {
    const auto known = gains_.find(run);
    gain = known == gains_.end() ? gain_of(runs_[run], dark) : std::move(known->second);
  }
  gains_ = std::move(needed);
}

std::vector<double> FlatsInTime::gain(std::int64_t view) const {
  const Between b = between(view);
  const std::vector<double>&before = gains_.at(b.before), &after = gains_.at(b.after);
  const double scale = by_current_ ? raw_.beam_in_time.projection_currents[at(view)] / mean_current_ : 1.0;
  std::vector<double> out(before.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double gain = scale * ((1 - b.share) * before[i] + b.share * after[i]);
    const bool usable = before[i] > 0 && after[i] > 0 && std::isfinite(gain);
    out[i] = usable ? gain : std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

}  // namespace vdvr
