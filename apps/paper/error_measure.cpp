#include "apps/paper/error_measure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "vdvr/error.hpp"

namespace vdvr::paper {
namespace {

struct Moments {
  double mean = 0, deviation = 0;
};
Moments moments(std::span<const float> values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const float v : values) sum += static_cast<double>(v);
  const double mean = sum / n;
  for (const float v : values) squares += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
  return {mean, std::sqrt(squares / n)};
}

double percentile(std::vector<float> errors, double part) {
  const auto at = static_cast<std::size_t>(std::ceil(part * static_cast<double>(errors.size()))) - 1;
  const auto place = errors.begin() + static_cast<std::ptrdiff_t>(std::min(at, errors.size() - 1));
  std::nth_element(errors.begin(), place, errors.end());
  return static_cast<double>(*place);
}

}  // namespace

ErrorMeasure measure_error(std::span<const float> values, std::span<const float> truth) {
  if (values.size() != truth.size() || values.empty())
    throw InputError(fmt::format("{} values cannot be measured against {}", values.size(), truth.size()));
  const Moments v = moments(values), t = moments(truth);
  // A constant has no deviation to normalise: only its mean is then moved.
  const double gain = v.deviation > 0 ? t.deviation / v.deviation : 1;
  ErrorMeasure m;
  m.count = static_cast<std::int64_t>(values.size());
  m.mean_error = v.mean - t.mean;
  m.deviation_ratio = t.deviation > 0 ? v.deviation / t.deviation : 1;
  double squares = 0, normalised = 0;
  std::vector<float> errors(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = static_cast<double>(values[i]), true_value = static_cast<double>(truth[i]);
    const double error = value - true_value, registered = (value - v.mean) * gain + t.mean - true_value;
    squares += error * error;
    normalised += registered * registered;
    errors[i] = static_cast<float>(std::abs(error));
  }
  const auto n = static_cast<double>(values.size());
  m.rms = std::sqrt(squares / n);
  m.rms_normalised = std::sqrt(normalised / n);
  if (!std::isfinite(squares)) {
    m.max = m.p99 = std::numeric_limits<double>::quiet_NaN();
    return m;
  }
  m.max = static_cast<double>(*std::max_element(errors.begin(), errors.end()));
  m.p99 = percentile(std::move(errors), 0.99);
  return m;
}

}  // namespace vdvr::paper
