#include "host/scan/raw/name_angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "host/base/system/lower.hpp"

namespace vdvr::io {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

// One of the numbers in all names, in the order of the files.
struct Field {
  std::vector<double> values;
  int decimals = 0;     // the most that one has
  bool signs = false;   // one has a sign
  bool worded = false;  // a word beside it says that it is an angle

  [[nodiscard]] bool marked() const { return signs || worded || decimals > 0; }
  [[nodiscard]] bool varies() const {
    return std::any_of(values.begin(), values.end(), [&](double v) { return v != values.front(); });
  }
  // As names that only count their files have it.
  [[nodiscard]] bool counts() const {
    for (std::size_t k = 0; k < values.size(); ++k)
      if (values[k] != values.front() + static_cast<double>(k)) return false;
    return true;
  }
  // Half of the last decimal, and what its decimal fraction is off in binary.
  [[nodiscard]] double rounding() const { return 0.5 * std::pow(10.0, -decimals) * (1 + 1e-6) + 1e-9; }
};

bool is_word_of_angles(const std::string& name, std::size_t first, std::size_t end) {
  std::string before, after;
  for (std::size_t i = first; i > 0 && is_letter(name[i - 1]); --i)
    before.insert(before.begin(), name[i - 1]);
  if (before.empty() && first > 0 && (name[first - 1] == '_' || name[first - 1] == '='))
    for (std::size_t i = first - 1; i > 0 && is_letter(name[i - 1]); --i)
      before.insert(before.begin(), name[i - 1]);
  for (std::size_t i = end; i < name.size() && is_letter(name[i]); ++i) after += name[i];
  before = lower(before);
  after = lower(after);
  const bool degree_sign = name.compare(end, 2, "\u00b0") == 0;
  return degree_sign || after.starts_with("deg") || before == "deg" || before == "ang" || before == "angle" ||
         before == "theta" || before == "degree" || before == "degrees";
}

// The numbers of a name, appended to the fields; false where it has more or fewer than the names before.
bool add_numbers(const std::string& name, bool first_name, std::vector<Field>& fields) {
  std::size_t field = 0;
  for (std::size_t i = 0; i < name.size();) {
    if (!is_digit(name[i])) {
      ++i;
      continue;
    }
    std::size_t first = i, end = i;
    while (end < name.size() && is_digit(name[end])) ++end;
    std::string text = name.substr(i, end - i);
    int decimals = 0;
    if (end + 1 < name.size() && (name[end] == '.' || name[end] == ',') && is_digit(name[end + 1])) {
      std::size_t last = end + 1;
      while (last < name.size() && is_digit(name[last])) ++last;
      decimals = static_cast<int>(last - end - 1);
      text += "." + name.substr(end + 1, last - end - 1);
      end = last;
    }
    // A minus after a letter or a digit is a hyphen.
    const bool sign =
        first > 0 && (name[first - 1] == '+' ||
                      (name[first - 1] == '-' &&
                       (first == 1 || (!is_letter(name[first - 2]) && !is_digit(name[first - 2])))));
    if (first_name) fields.emplace_back();
    if (field == fields.size()) return false;
    double value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    Field& f = fields[field++];
    f.values.push_back(sign && name[first - 1] == '-' ? -value : value);
    f.decimals = std::max(f.decimals, std::min(decimals, 12));
    f.signs = f.signs || sign;
    f.worded = f.worded || is_word_of_angles(name, sign ? first - 1 : first, end);
    i = end;
  }
  return field == fields.size();
}

std::vector<Field> fields_of(const std::vector<std::string>& names) {
  std::vector<Field> fields;
  for (const std::string& path : names)
    if (!add_numbers(std::filesystem::path(path).filename().string(), &path == &names.front(), fields))
      return {};
  std::erase_if(fields, [](const Field& f) { return !f.varies(); });
  return fields;
}

// angle = sign * value + shift for every view, whole turns apart, to the rounding of names.
bool follows(const std::vector<double>& angles, const Field& f, double sign) {
  const double shift = angles[0] - sign * f.values[0];
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const double off = angles[k] - sign * f.values[k] - shift;
    if (!(std::abs(off - 360 * std::round(off / 360)) <= 2 * f.rounding())) return false;
  }
  return true;
}

// The shift where, in whatever order, the names have the angles; NaN where they do not.
double shift_of_same(std::vector<double> angles, const Field& f, double sign) {
  std::vector<double> values;
  for (const double v : f.values) values.push_back(sign * v);
  std::sort(angles.begin(), angles.end());
  std::sort(values.begin(), values.end());
  const double shift = angles[0] - values[0];
  for (std::size_t k = 0; k < angles.size(); ++k)
    if (!(std::abs(angles[k] - values[k] - shift) <= 2 * f.rounding())) return NAN;
  return shift;
}

}  // namespace

std::string names_against(const std::vector<std::string>& names, const std::vector<double>& angles_deg) {
  if (names.size() < 3 || names.size() != angles_deg.size()) return "";
  const std::vector<Field> fields = fields_of(names);
  for (const Field& f : fields)
    if (follows(angles_deg, f, 1) || follows(angles_deg, f, -1)) return "";
  for (const Field& f : fields) {
    if (!f.marked() && f.counts()) continue;
    const double shift = shift_of_same(angles_deg, f, 1);
    const bool same = std::isfinite(shift) || std::isfinite(shift_of_same(angles_deg, f, -1));
    if (!same && !f.worded) continue;
    std::size_t k = 0;
    const double known = std::isfinite(shift) ? shift : 0;
    while (k + 1 < names.size() && std::abs(angles_deg[k] - f.values[k] - known) <= 2 * f.rounding()) ++k;
    return fmt::format(
        "{} gets the angle {:g} by 'angles', but its name says {:g}{}: files are taken in the natural order "
        "of "
        "their names, in which signs do not count. List them in the order of 'angles', or write \"angles\": "
        "\"names\" to take each angle from the name",
        names[k], angles_deg[k], f.values[k],
        known == 0 ? "" : fmt::format(" (others differ by {:g})", known));
  }
  return "";
}

std::vector<double> angles_in_names(const std::vector<std::string>& names, std::string& why) {
  if (names.empty()) {
    why = "projections are not one file each";
    return {};
  }
  std::vector<Field> fields = fields_of(names);
  if (fields.size() > 1 && std::any_of(fields.begin(), fields.end(), [](const Field& f) { return f.worded; }))
    std::erase_if(fields, [](const Field& f) { return !f.worded; });
  if (fields.size() > 1 &&
      std::any_of(fields.begin(), fields.end(), [](const Field& f) { return f.marked(); }))
    std::erase_if(fields, [](const Field& f) { return !f.marked(); });
  if (fields.size() == 1) return fields.front().values;
  why = fields.empty() ? "no number varies from name to name, or names differ in how many they have"
                       : fmt::format("{} numbers vary from name to name", fields.size());
  return {};
}

}  // namespace vdvr::io
