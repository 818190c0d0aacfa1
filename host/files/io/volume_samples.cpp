#include "host/files/io/volume_samples.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "host/base/system/limits.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {

VolumeSamples::VolumeSamples(std::string name, const std::array<std::int64_t, 3>& samples,
                             std::uint64_t max_memory_bytes, std::optional<double> nan_as)
    : name_(std::move(name)), nan_as_(nan_as) {
  if (nan_as && !std::isfinite(static_cast<float>(*nan_as)))
    throw InputError(fmt::format("`nan_as` {} is no finite float itself", *nan_as));
  for (std::size_t a = 0; a < 3; ++a) {
    // One sample bounds no cell, so there is nothing to interpolate in.
    if (samples[a] < 2)
      throw FileError(fmt::format("{}: {} samples (x, y, z), but each axis needs at least two", name_,
                                  shape_text(samples)));
    volume_.grid.cells[a] = samples[a] - 1;
  }
  const std::uint64_t bytes = checked_bytes(samples, sizeof(float), name_);
  require_memory(bytes, max_memory_bytes, name_);
  volume_.samples.reserve(bytes / sizeof(float));
}

void VolumeSamples::append(std::span<const double> samples) {
  for (const double s : samples) {
    auto value = static_cast<float>(s);
    if (!std::isfinite(value)) {
      if (bad_ == 0) first_bad_ = volume_.samples.size(), bad_value_ = s;
      ++bad_;
      value = static_cast<float>(nan_as_.value_or(0));
    }
    volume_.samples.push_back(value);
  }
}

Volume VolumeSamples::take() {
  if (bad_ > 0 && !nan_as_) {
    const Index3 n = volume_.grid.samples();
    const auto first = static_cast<std::int64_t>(first_bad_);
    throw FileError(
        fmt::format("{}: {} of {} samples are no finite floats, the first, of column {}, row {}, slice {}, "
                    "is {}; `nan_as` 0 "
                    "reads them all as 0, another number as that",
                    name_, bad_, volume_.samples.size(), first % n[0], first / n[0] % n[1],
                    first / n[0] / n[1], bad_value_));
  }
  return std::move(volume_);
}

}  // namespace vdvr::io
