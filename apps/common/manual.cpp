#include "apps/common/manual.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cstdlib>
#include <ctime>

#include "apps/common/option_table.hpp"

namespace vdvr::cli {
namespace {

/// Text that roff leaves alone. A '-' would become a hyphen, which nobody can paste into a shell; a line may
/// be broken after '|'; what stands between backticks is bold.
std::string plain(const std::string& text) {
  std::string out;
  bool bold = false;
  for (const char c : text) {
    switch (c) {
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '|':
        out += "|\\:";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '"':
        out += "\\(dq";
        break;
      case '`':
        bold = !bold;
        out += bold ? "\\fB" : "\\fR";
        break;
      default:
        out += c;
    }
  }
  return !out.empty() && out[0] == '.' ? "\\&" + out : out;
}

std::string capitals(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// The day of the page: that of SOURCE_DATE_EPOCH, by which builds can be repeated, else today.
std::string day() {
  const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
  std::time_t seconds = epoch != nullptr ? std::strtoll(epoch, nullptr, 10) : std::time(nullptr);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:04}-{:02}-{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday);
}

std::string head(const std::string& page, const std::string& purpose) {
  return fmt::format(
      ".TH {} 1 \"{}\" \"VDVR {}\" \"User Commands\"\n.nh\n.ad l\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n",
      plain(capitals(page)), day(), VDVR_VERSION, plain(page), plain(purpose));
}

/// "vdvr build IN ..." with the program's own words, of which there are `bold`, in bold.
std::string synopsis(const std::string& usage, std::size_t bold) {
  std::size_t end = 0;
  for (std::size_t word = 0; word < bold && end != std::string::npos; ++word) end = usage.find(' ', end + 1);
  if (end == std::string::npos) return fmt::format("\\fB{}\\fR\n", plain(usage));
  return fmt::format("\\fB{}\\fR{}\n", plain(usage.substr(0, end)), plain(usage.substr(end)));
}

std::string options_text(const OptionTable& table, bool with_titles) {
  std::string text;
  for (const auto& [name, help] : table.positionals)
    text += fmt::format(".TP\n\\fI{}\\fR\n{}\n", plain(name), plain(help));
  for (const auto& group : table.groups) {
    if (with_titles && group.title != "Options") text += fmt::format(".SS {}\n", plain(group.title));
    for (const auto& o : group.options) {
      const std::string before = o.short_name.empty() ? "" : fmt::format("\\fB{}\\fR, ", plain(o.short_name));
      const std::string after = o.shape.empty() ? "" : fmt::format(" \\fI{}\\fR", plain(o.shape));
      text += fmt::format(".TP\n{}\\fB{}\\fR{}\n{}\n", before, plain(o.name), after, plain(o.help));
    }
  }
  return text;
}

std::string examples_text(const std::vector<Example>& examples) {
  std::string text = examples.empty() ? "" : ".SH EXAMPLES\n";
  for (const auto& [line, effect] : examples)
    text += fmt::format(".TP\n\\fB{}\\fR\n{}\n", plain(line), plain(effect));
  return text;
}

constexpr const char* exit_status =
    ".SH EXIT STATUS\n"
    ".TP\n0\ndone\n"
    ".TP\n1\na certificate, hash or input does not match, or the tolerance is out of reach\n"
    ".TP\n2\nbad usage or an unreadable input\n"
    ".TP\n3\ndevice, memory or disk\n"
    ".TP\n130, 143\ninterrupted\n";

std::string words_of(std::string page) {
  for (std::size_t at = 0; (at = page.find(' ', at)) != std::string::npos;) page[at] = '-';
  return page;
}

}  // namespace

std::string overview_page(const std::string& program, const std::string& purpose,
                          const std::vector<Command>& commands) {
  std::string text = head(program, purpose);
  text += fmt::format(
      "\\fB{0}\\fR \\fICOMMAND\\fR [options]\n.br\n\\fB{0}\\fR \\fICOMMAND\\fR \\fB\\-\\-help\\fR\n.br\n"
      "\\fB{0}\\fR \\fB\\-\\-version\\fR\n.br\n\\fB{0}\\fR \\fB\\-\\-man\\fR [\\fICOMMAND\\fR]\n.br\n"
      "\\fB{0}\\fR \\fB\\-\\-completion bash\\fR\n",
      program);
  text +=
      ".SH DESCRIPTION\nFiltered back\\-projection turns X\\-ray projections into one continuous field. This "
      "program builds a volume that is fine only where it must be, measures its distance from that field, "
      "writes a certificate, and draws the volume without a window on any OpenCL device.\n";
  text += ".SH COMMANDS\n";
  for (const Command& c : commands)
    text += fmt::format(".TP\n\\fB{}\\fR\n{}; see \\fB{}\\fR(1)\n", plain(c.name), plain(c.purpose),
                        plain(words_of(c.who())));
  text += ".SH OPTIONS\n.TP\n\\fB\\-\\-help\\fR, \\fB\\-h\\fR\nthe commands; after a command its options\n";
  text += ".TP\n\\fB\\-\\-version\\fR\nthe version\n";
  text += ".TP\n\\fB\\-\\-man\\fR [\\fICOMMAND\\fR]\nthis page or that of a command, for man \\-l\n";
  text += ".TP\n\\fB\\-\\-completion bash\\fR\nthe completion of the shell's command line\n";
  text += exit_status;
  text += ".SH SEE ALSO\n";
  for (std::size_t i = 0; i < commands.size(); ++i)
    text += fmt::format("\\fB{}\\fR(1){}\n", plain(words_of(commands[i].who())),
                        i + 1 < commands.size() ? "," : "");
  return text;
}

std::string command_page(const Command& command) {
  const bool whole_program = *command.name == '\0';
  const std::size_t words = whole_program ? 1 : 2;
  std::vector<OptionTable> cases;
  for (const auto& word : command.cases) cases.push_back(option_table(command, word));
  const OptionTable table = option_table(command);

  std::string text = head(words_of(command.who()), command.purpose);
  if (cases.empty()) text += synopsis(table.usage, words);
  for (std::size_t i = 0; i < cases.size(); ++i)
    text += (i == 0 ? "" : ".br\n") + synopsis(cases[i].usage, words + 1);
  if (cases.empty()) text += ".SH OPTIONS\n" + options_text(table, true);
  for (std::size_t i = 0; i < cases.size(); ++i)
    text +=
        fmt::format(".SH {}\n", plain(capitals(command.cases[i]))) + options_text(cases[i], /*titles*/ true);
  text += examples_text(command.examples);
  text += exit_status;
  if (!whole_program) text += fmt::format(".SH SEE ALSO\n\\fB{}\\fR(1)\n", command.program);
  return text;
}

}  // namespace vdvr::cli
