#include "host/files/io/length_unit.hpp"

#include <array>
#include <cstdlib>
#include <utility>

namespace vdvr {
namespace {

// The prefixes' names; "MM" is a millimetre in capitals, since nobody measures samples in megametres.
constexpr std::array<std::pair<const char*, int>, 6> prefixes{
    {{"", 0}, {"centi", -2}, {"milli", -3}, {"micro", -6}, {"nano", -9}, {"pico", -12}}};
constexpr std::array<std::pair<const char*, int>, 8> symbols{{{"m", 0},
                                                              {"cm", -2},
                                                              {"mm", -3},
                                                              {"um", -6},
                                                              {"micron", -6},
                                                              {"nm", -9},
                                                              {"pm", -12},
                                                              {"angstrom", -10}}};

// In small letters, without blanks about it, with u for the micro sign of UTF-8 (two code points) or Latin-1.
std::string plain(const std::string& unit) {
  std::string text;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const std::string two = unit.substr(i, 2);
    if (two == "\xc2\xb5" || two == "\xce\xbc" || two == "\xce\x9c") text += 'u', ++i;
    else if (unit[i] == '\xb5') text += 'u';
    else if (unit[i] >= 'A' && unit[i] <= 'Z') text += static_cast<char>(unit[i] - 'A' + 'a');
    else if (unit[i] != ' ' && unit[i] != '\t' && unit[i] != '\0') text += unit[i];
  }
  return text;
}

}  // namespace

std::optional<int> metres_exponent(const std::string& unit) {
  std::string text = plain(unit);
  if (text.size() > 2 && text.back() == 's') text.pop_back();
  for (const auto& [symbol, exponent] : symbols)
    if (text == symbol) return exponent;
  for (const auto& [prefix, exponent] : prefixes)
    for (const char* metre : {"meter", "metre"})
      if (text == std::string(prefix) + metre) return exponent;
  return {};
}

double power_of_ten(int n) {
  double power = 1;
  for (int i = 0; i < std::abs(n); ++i) power *= 10;  // exact up to 10^22
  return n < 0 ? 1 / power : power;
}

}  // namespace vdvr
