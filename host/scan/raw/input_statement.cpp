#include "vdvr/expert/input_statement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr std::array<std::pair<SampleValues, const char*>, 3> names{
    {{SampleValues::counts, "counts"},
     {SampleValues::transmission, "transmission"},
     {SampleValues::line_integrals, "line integrals"}}};

constexpr std::array<std::pair<AngleUnit, const char*>, 2> units{
    {{AngleUnit::degrees, "degrees"}, {AngleUnit::radians, "radians"}}};

template <class T, std::size_t n>
const char* name_of(const std::array<std::pair<T, const char*>, n>& list, T value) {
  for (const auto& [one, name] : list)
    if (one == value) return name;
  return "";
}

template <class T, std::size_t n>
std::optional<T> named(const std::array<std::pair<T, const char*>, n>& list, const std::string& text) {
  for (const auto& [one, name] : list)
    if (text == name) return one;
  return {};
}

std::int64_t bound_of(const std::string& text, const std::string& range, std::int64_t if_empty) {
  if (text.empty()) return if_empty;
  std::int64_t value = 0;
  const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || rest != text.data() + text.size() || value < 0)
    throw InputError(
        fmt::format("views: '{}' is no range of views; ranges are half-open, such as 0:40,41:90", range));
  return value;
}

std::pair<std::int64_t, std::int64_t> range_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (text.empty() || text == ":") static_cast<void>(bound_of("-", text, 0));
  if (colon != std::string::npos)
    return {bound_of(text.substr(0, colon), text, 0), bound_of(text.substr(colon + 1), text, last_view)};
  const std::int64_t one = bound_of(text, text, 0);
  return {one, one == last_view ? one : one + 1};
}

}  // namespace

const char* text_of(SampleValues values) { return name_of(names, values); }

std::optional<SampleValues> sample_values_of(const std::string& text) { return named(names, text); }

const char* text_of(AngleUnit unit) { return name_of(units, unit); }

std::optional<AngleUnit> angle_unit_of(const std::string& text) { return named(units, text); }

ViewRanges view_ranges_of(const std::string& text) {
  ViewRanges ranges;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    ranges.push_back(range_of(text.substr(start, end - start)));
    start = end + 1;
  }
  return ranges;
}

std::string text_of(const ViewRanges& ranges) {
  std::string text;
  for (const auto& [first, end] : ranges) {
    text += text.empty() ? "" : ",";
    text += end == last_view ? fmt::format("{}:", first) : fmt::format("{}:{}", first, end);
  }
  return text;
}

ViewRanges checked_ranges(ViewRanges ranges, std::int64_t count) {
  std::int64_t past = 0;
  for (auto& [first, end] : ranges) {
    if (end == last_view) end = count;
    if (!(0 <= first && first < end && end <= count))
      throw InputError(fmt::format("[{}, {}) is not a range within the {} projections", first, end, count));
    if (first < past)
      throw InputError(
          fmt::format("range [{}, {}) begins before the one before it ends, at {}; ranges of "
                      "views rise and do not overlap",
                      first, end, past));
    past = end;
  }
  return ranges;
}

std::string text_of(const InputStatement& s) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  if (!s.entry.empty()) add("entry " + s.entry);
  if (!s.views.empty()) add("views " + text_of(s.views));
  if (s.dark) add(fmt::format("darks {}", *s.dark));
  if (s.flat) add(fmt::format("flats {}", *s.flat));
  if (s.values) add(text_of(*s.values));
  if (s.angle_unit) add(fmt::format("angles in {}", text_of(*s.angle_unit)));
  if (!s.beam_current.empty()) add("beam current " + s.beam_current);
  if (s.axis_roll_deg) add(fmt::format("axis roll {}", *s.axis_roll_deg));
  return text.empty() ? "none" : text;
}

}  // namespace vdvr
