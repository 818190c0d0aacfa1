// The words after a command's name: declared, parsed strictly, and read by typed getters whose errors name
// the option. Every command declares its options on the Arguments it is given, then calls parse().
#pragma once

#include <array>
#include <boost/program_options.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/command.hpp"
#include "apps/common/option_table.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr::cli {

class Arguments {
 public:
  Arguments(const Command& command, std::vector<std::string> tokens);
  /// Not to run the command but to learn its options: parse() fills `table` and gives false.
  Arguments(const Command& command, std::vector<std::string> tokens, OptionTable& table);

  /// Opens a new heading of the help text; options declared next belong to it.
  Arguments& group(const std::string& title);
  Arguments& flag(const std::string& name, const std::string& help);
  /// `name` may be "output,o"; `shape` is the placeholder of the help text.
  Arguments& value(const std::string& name, const std::string& shape, const std::string& help);
  /// A value that may be left out, and is `implied` then: --name, or --name=VALUE.
  Arguments& value_or_flag(const std::string& name, const std::string& shape, const std::string& implied,
                           const std::string& help);
  /// The same, which may be given several times; read by texts().
  Arguments& values(const std::string& name, const std::string& shape, const std::string& help);
  /// As value(), but told by neither --help nor man pages nor completion: for comparisons, in the documents.
  Arguments& hidden(const std::string& name, const std::string& shape);
  /// The next stray word; all positionals are required.
  Arguments& positional(const std::string& name, const std::string& help);

  /// False when --help or --help-all was asked for and printed. Throws InputError for what does not parse.
  [[nodiscard]] bool parse();

  [[nodiscard]] std::string who() const { return command_.who(); }
  /// All words as they were given, but for what take_word took.
  [[nodiscard]] const std::vector<std::string>& words() const { return tokens_; }
  /// Takes the first word away (the case of `bench`); empty when there is none or it is an option.
  std::string take_word();

  [[nodiscard]] bool has(const std::string& name) const;
  /// True when the words hold "--name value", whatever else they lack; for options that only ask. Before
  /// parse().
  [[nodiscard]] bool asks(const std::string& name, const std::string& value) const;
  /// The text given; InputError when it is absent.
  [[nodiscard]] std::string text(const std::string& name) const;
  /// Every text given for an option that `values` declared; empty when there is none.
  [[nodiscard]] std::vector<std::string> texts(const std::string& name) const;
  [[nodiscard]] std::string text_or(const std::string& name, const std::string& fallback) const;
  [[nodiscard]] std::filesystem::path path(const std::string& name) const { return text(name); }
  [[nodiscard]] std::optional<double> number(const std::string& name) const;
  [[nodiscard]] double number_or(const std::string& name, double fallback) const;
  [[nodiscard]] double positive_or(const std::string& name, double fallback) const;
  [[nodiscard]] std::optional<std::int64_t> integer(const std::string& name) const;
  [[nodiscard]] std::int64_t integer_or(const std::string& name, std::int64_t fallback, std::int64_t lowest,
                                        std::int64_t highest) const;
  /// Numbers separated by commas; a count of 0 takes any.
  [[nodiscard]] std::optional<std::vector<double>> numbers(const std::string& name, std::size_t count) const;
  /// One number or two, above 0; one stands for both.
  [[nodiscard]] std::optional<std::array<double, 2>> one_or_two(const std::string& name) const;
  [[nodiscard]] std::optional<Vec3> vec3(const std::string& name) const;
  /// `count` positive integers separated by 'x'.
  [[nodiscard]] std::optional<std::vector<std::int64_t>> sizes(const std::string& name,
                                                               std::size_t count) const;
  /// One of those that the placeholder lists, `a|b|c`; `fallback` when absent.
  [[nodiscard]] std::string choice(const std::string& name, const std::string& fallback) const;
  /// One of `allowed`; `fallback` when absent.
  [[nodiscard]] std::string choice(const std::string& name, const std::vector<std::string>& allowed,
                                   const std::string& fallback) const;

 private:
  void print_help(bool all) const;
  /// Those options that --help explains; none where it explains all.
  [[nodiscard]] boost::program_options::options_description main_options() const;
  [[nodiscard]] OptionTable table() const;
  /// "vdvr build"; "vdvr bench tune" once the case was taken.
  [[nodiscard]] std::string name() const;
  [[nodiscard]] std::string usage() const;

  const Command& command_;
  OptionTable* asked_ = nullptr;  ///< whoever wants the table instead of the command
  std::vector<std::string> tokens_;
  std::string case_;  ///< the word that take_word took
  std::vector<boost::program_options::options_description> groups_;
  std::vector<std::string> titles_;  ///< of the groups, which Boost does not give back
  boost::program_options::options_description hidden_;
  boost::program_options::positional_options_description positionals_;
  std::vector<std::pair<std::string, std::string>> positional_help_;
  boost::program_options::variables_map values_;
};

/// "2G" and the like: K, M, G, T are powers of 1024. Throws InputError.
std::uint64_t parse_bytes(const std::string& option, const std::string& text);
/// What lies between the separators; of an empty text one empty part.
std::vector<std::string> split(const std::string& text, char separator);
/// A whole text as a finite number; throws InputError naming `what`.
double parse_number(const std::string& what, const std::string& text);
/// Three numbers separated by commas; throws InputError naming `what`.
Vec3 parse_vec3(const std::string& what, const std::string& text);

}  // namespace vdvr::cli
