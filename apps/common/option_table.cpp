#include "apps/common/option_table.hpp"

#include <algorithm>
#include <cctype>

#include "apps/common/arguments.hpp"

namespace vdvr::cli {
namespace {

bool is_small(char c) { return std::islower(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

bool is_word(const std::string& part) {
  return !part.empty() && is_small(part[0]) &&
         std::all_of(part.begin(), part.end(), [](char c) { return is_small(c) || is_digit(c) || c == '-'; });
}

bool is_whole(const std::string& part) {
  const std::size_t sign = !part.empty() && part[0] == '-' ? 1 : 0;
  return part.size() > sign &&
         std::all_of(part.begin() + static_cast<std::ptrdiff_t>(sign), part.end(), is_digit);
}

/// A '.' before a letter: OUT.vdvr, but neither 0.03 nor V[,V...].
bool has_ending(const std::string& part) {
  for (std::size_t i = 0; i + 1 < part.size(); ++i)
    if (part[i] == '.' && is_small(part[i + 1])) return true;
  return false;
}

}  // namespace

OptionTable option_table(const Command& command, const std::string& case_word) {
  OptionTable table;
  Arguments args(command,
                 case_word.empty() ? std::vector<std::string>{} : std::vector<std::string>{case_word}, table);
  command.run(args);
  return table;
}

Operand operand_of(const std::string& shape) {
  const std::vector<std::string> parts = split(shape, '|');
  Operand operand;
  const bool numbers = parts.size() > 1 && std::all_of(parts.begin(), parts.end(), is_whole);
  for (const auto& part : parts) {
    if (numbers || is_word(part)) {
      operand.choices.push_back(part);
    } else if (part == "FILE" || part == "IN" || part == "OUT" || part == "VOL" || has_ending(part)) {
      operand.file = true;
    } else if (part == "DIR") {
      operand.folder = true;
    }
  }
  return operand;
}

}  // namespace vdvr::cli
