#include "host/picture/ticks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace vdvr {
namespace {

const std::string kMinus = "−";

std::string with_minus(std::string text) {
  // Of an exponent too.
  for (std::size_t at = text.find('-'); at != std::string::npos; at = text.find('-', at + kMinus.size()))
    text.replace(at, 1, kMinus);
  return text;
}

std::string superscript(int number) {
  static const std::array<const char*, 10> digits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text;
  for (const char c : std::to_string(number)) {
    if (c == '-') text += "⁻";
    else text += digits[static_cast<std::size_t>(c - '0')];
  }
  return text;
}

/// Factor and power of ten of the step: 1, 2 or 5.
struct Step {
  int factor = 1, power = 0;
  [[nodiscard]] double value() const { return factor * std::pow(10.0, power); }
  [[nodiscard]] Step next() const {
    return factor == 1 ? Step{2, power} : factor == 2 ? Step{5, power} : Step{1, power + 1};
  }
};

/// Numbers below these read well as they are.
constexpr double kLargest = 1e5, kSmallest = 1e-3;

int exponent_of(double magnitude) {
  if (!(magnitude > 0) || (magnitude < kLargest && magnitude >= kSmallest)) return 0;
  return static_cast<int>(std::floor(std::log10(magnitude)));
}

Ticks ends_of(double lo, double hi) {
  Ticks ends;
  ends.exponent = exponent_of(std::max(std::abs(lo), std::abs(hi)));
  const double unit = std::pow(10.0, ends.exponent);
  ends.ticks.push_back({lo, with_minus(fmt::format("{:.4g}", lo / unit))});
  std::string high = with_minus(fmt::format("{:.4g}", hi / unit));
  if (high != ends.ticks.front().label) ends.ticks.push_back({hi, std::move(high)});
  return ends;
}

}  // namespace

Ticks round_ticks(double lo, double hi, int most) {
  if (!std::isfinite(lo) || !std::isfinite(hi) || !(lo <= hi)) return {};
  const double span = hi - lo, magnitude = std::max(std::abs(lo), std::abs(hi));
  // Where fewer than ten digits are left for the difference, round values would not be round.
  constexpr double told_apart = 1e-10;
  if (!std::isfinite(span) || !(span > told_apart * magnitude)) return ends_of(lo, hi);
  Step step{1, static_cast<int>(std::floor(std::log10(span))) - 2};
  const auto count = [&] {
    // A multiple that rounding moved beyond an end still counts.
    const double slack = 1e-9;
    const double first = std::ceil(lo / step.value() - slack), last = std::floor(hi / step.value() + slack);
    return std::pair{first, last};
  };
  while (count().second - count().first + 1 > most) step = step.next();
  const auto [first, last] = count();
  if (last - first < 1) return ends_of(lo, hi);
  Ticks out;
  out.exponent = exponent_of(magnitude);
  const int decimals = std::max(0, out.exponent - step.power);
  for (double k = first + 0.0; k <= last; ++k) {  // not the zero with a sign
    // From the integers, so that 0 is 0 and labels are round.
    const double value = k * step.factor * std::pow(10.0, step.power);
    out.ticks.push_back(
        {std::clamp(value, lo, hi),
         with_minus(
             fmt::format("{:.{}f}", k * step.factor * std::pow(10.0, step.power - out.exponent), decimals))});
  }
  return out;
}

double round_length(double length) {
  Step step{1, static_cast<int>(std::floor(std::log10(length))) - 1};
  while (step.next().value() <= length * (1 + 1e-9)) step = step.next();
  return step.value();
}

ShownUnit shown_unit(const std::string& unit, double extent) {
  constexpr std::array<std::pair<const char*, double>, 11> metres{{{"km", 1e3},
                                                                   {"m", 1},
                                                                   {"dm", 1e-1},
                                                                   {"cm", 1e-2},
                                                                   {"mm", 1e-3},
                                                                   {"um", 1e-6},
                                                                   {"µm", 1e-6},
                                                                   {"μm", 1e-6},
                                                                   {"micron", 1e-6},
                                                                   {"nm", 1e-9},
                                                                   {"pm", 1e-12}}};
  const auto known =
      std::find_if(metres.begin(), metres.end(), [&](const auto& m) { return unit == m.first; });
  if (known == metres.end() || !(extent > 0) || !std::isfinite(extent)) return {1, unit};
  constexpr std::array<std::pair<const char*, double>, 5> shown{
      {{"m", 1}, {"mm", 1e-3}, {"µm", 1e-6}, {"nm", 1e-9}, {"pm", 1e-12}}};
  for (const auto& [name, metre] : shown)
    if (const double in_it = extent * known->second / metre; in_it >= 1) return {known->second / metre, name};
  return {known->second / shown.back().second, shown.back().first};
}

std::string per_unit(const std::string& unit) { return unit + "⁻¹"; }

std::string times_power(int exponent) { return exponent == 0 ? "" : "×10" + superscript(exponent); }

std::string number_text(double value) {
  std::string text = with_minus(fmt::format("{:.4g}", value));
  const std::size_t e = text.find('e');
  if (e == std::string::npos) return text;
  const int exponent = exponent_of(std::abs(value));
  return with_minus(fmt::format("{:.4g}", value / std::pow(10.0, exponent))) + " " + times_power(exponent);
}

}  // namespace vdvr
