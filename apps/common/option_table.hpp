// The options of a command as data, from the declarations that its --help prints. manual.cpp and
// completion.cpp turn them into man pages and into completion, so that neither can fall behind.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "apps/common/command.hpp"

namespace vdvr::cli {

struct OptionRow {
  std::string name;        ///< "--output"
  std::string short_name;  ///< "-o", or empty
  std::string shape;       ///< the placeholder of its value; empty for a flag
  std::string help;
};

struct OptionGroup {
  std::string title;
  std::vector<OptionRow> options;
};

struct OptionTable {
  std::string usage;                                             ///< "vdvr build IN --epsilon E -o OUT.vdvr"
  std::vector<std::pair<std::string, std::string>> positionals;  ///< name and help
  std::vector<OptionGroup> groups;                               ///< none without options
};

/// What `command`, or that case of it, declares. Runs nothing of it beyond the declarations.
OptionTable option_table(const Command& command, const std::string& case_word = "");

/// What may stand where a placeholder does, read off its parts between '|': words in small letters, and
/// numbers where there are only numbers, stand for themselves; FILE, IN, VOL and what has an ending for
/// files.
struct Operand {
  std::vector<std::string> choices;
  bool file = false, folder = false;
};
Operand operand_of(const std::string& shape);

}  // namespace vdvr::cli
