#include "apps/common/completion.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/common/option_table.hpp"

namespace vdvr::cli {
namespace {

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

/// What the shell function learns of the option before the cursor; flags say nothing.
std::string operand_case(const OptionRow& option) {
  const Operand operand = operand_of(option.shape);
  std::string text =
      fmt::format("        {}{})", option.short_name.empty() ? "" : option.short_name + "|", option.name);
  text += fmt::format(" wanted=value words='{}'", joined(operand.choices));
  return text + fmt::format(" files={} ;;\n", operand.file ? "f" : operand.folder ? "d" : "");
}

/// The branch of one command, or of one case of it: its options, and what the one before the cursor takes.
std::string branch(const std::string& pattern, const OptionTable& table,
                   const std::vector<std::string>& words) {
  std::vector<std::string> names;
  std::string operands;
  for (const auto& group : table.groups)
    for (const auto& option : group.options) {
      if (!option.short_name.empty()) names.push_back(option.short_name);
      names.push_back(option.name);
      if (!option.shape.empty()) operands += operand_case(option);
    }
  std::string text = fmt::format("    {})\n      options='{}'\n", pattern, joined(names));
  if (!words.empty()) text += fmt::format("      words='{}'\n", joined(words));
  if (words.empty() && !table.positionals.empty()) text += "      files=f\n";
  if (!operands.empty()) text += fmt::format("      case $before in\n{}      esac\n", operands);
  return text + "      ;;\n";
}

constexpr const char* opening = R"sh({{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}}
  local options='' words='' files='' wanted='' found
  COMPREPLY=()
  # --option=value comes as three words
  if [ "$current" = = ]; then
    current=''
  elif [ "$before" = = ]; then
    before=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  local command=''
  if [ "$COMP_CWORD" -gt 1 ]; then
    command=${{COMP_WORDS[1]}}
  fi
{}  case $command in
)sh";

constexpr const char* closing = R"sh(  esac
  if [ -z "$wanted" ] && [ "${current:0:1}" = - ]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
    return
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  if [ -n "$files" ]; then
    compopt -o filenames 2>/dev/null
    while IFS= read -r found; do
      COMPREPLY+=("$found")
    done < <(compgen "-$files" -- "$current")
  fi
}
)sh";

}  // namespace

std::string bash_completion(const std::string& program, const std::vector<Command>& commands) {
  std::string function = "_" + program;
  std::replace(function.begin(), function.end(), '-', '_');
  const bool one_thing = commands.size() == 1 && *commands[0].name == '\0';

  std::string text =
      fmt::format("# bash completion of {0}; made by `{0} --completion bash`\n{1}()\n", program, function);
  std::vector<std::string> names, branches;
  std::string with_cases;
  for (const Command& c : commands) {
    names.emplace_back(c.name);
    branches.push_back(branch(one_thing ? "*" : c.name, option_table(c), c.cases));
    for (const auto& word : c.cases)
      branches.push_back(branch(fmt::format("'{} {}'", c.name, word), option_table(c, word), {}));
    if (!c.cases.empty())
      with_cases += fmt::format(
          "  if [ \"$command\" = {} ] && [ \"$COMP_CWORD\" -gt 2 ]; then\n"
          "    command+=\" ${{COMP_WORDS[2]}}\"\n  fi\n",
          c.name);
  }
  text += fmt::format(fmt::runtime(opening), with_cases);
  if (!one_thing)
    text += fmt::format(
        "    '')\n      options='--help --version --man --completion'\n      words='{0}'\n      ;;\n"
        "    --man)\n      words='{0}'\n      ;;\n    --completion)\n      words='bash'\n      ;;\n",
        joined(names));
  for (const auto& one : branches) text += one;
  return text + closing + fmt::format("complete -F {} {}\n", function, program);
}

}  // namespace vdvr::cli
