// GCC 12 sees a null dereference in boost::any_cast inlined into typed_value::notify, which checks for it.
#pragma GCC diagnostic ignored "-Wnull-dereference"
#include "apps/common/arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "vdvr/error.hpp"

namespace po = boost::program_options;

namespace vdvr::cli {
namespace {

std::int64_t parse_integer(const std::string& what, const std::string& text) {
  std::int64_t result = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), result);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError(fmt::format("{}: '{}' is not a whole number", what, text));
  return result;
}

std::string option(const std::string& name) { return "--" + name; }

}  // namespace

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

double parse_number(const std::string& what, const std::string& text) {
  const std::size_t plus = !text.empty() && text[0] == '+' ? 1 : 0;  // from_chars takes no plus sign
  double result = 0;
  const auto [end, error] = std::from_chars(text.data() + plus, text.data() + text.size(), result);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(result))
    throw InputError(fmt::format("{}: '{}' is not a finite number", what, text));
  return result;
}

Vec3 parse_vec3(const std::string& what, const std::string& text) {
  const auto parts = split(text, ',');
  if (parts.size() != 3)
    throw InputError(fmt::format("{}: '{}' is not three numbers separated by commas", what, text));
  return {parse_number(what, parts[0]), parse_number(what, parts[1]), parse_number(what, parts[2])};
}

std::uint64_t parse_bytes(const std::string& option_name, const std::string& text) {
  const std::string units = "KMGT";
  std::string digits = text;
  double factor = 1;
  if (!digits.empty()) {
    const std::size_t unit =
        units.find(static_cast<char>(std::toupper(static_cast<unsigned char>(digits.back()))));
    if (unit != std::string::npos) {
      factor = std::ldexp(1.0, 10 * static_cast<int>(unit + 1));
      digits.pop_back();
    }
  }
  double number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const double bytes = number * factor;
  if (error != std::errc() || end != digits.data() + digits.size() || !(bytes >= 1 && bytes < 0x1p62))
    throw InputError(fmt::format("{}: '{}' is not an amount of memory; write 512M or 2G", option_name, text));
  return static_cast<std::uint64_t>(bytes);
}

Arguments::Arguments(const Command& command, std::vector<std::string> tokens)
    : command_(command), tokens_(std::move(tokens)) {
  group("Options");
}

Arguments::Arguments(const Command& command, std::vector<std::string> tokens, OptionTable& table)
    : Arguments(command, std::move(tokens)) {
  asked_ = &table;
}

Arguments& Arguments::group(const std::string& title) {
  groups_.emplace_back(title, 110, 70);
  titles_.push_back(title);
  return *this;
}

Arguments& Arguments::flag(const std::string& name, const std::string& help) {
  groups_.back().add_options()(name.c_str(), help.c_str());
  return *this;
}

Arguments& Arguments::value(const std::string& name, const std::string& shape, const std::string& help) {
  groups_.back().add_options()(name.c_str(), po::value<std::string>()->value_name(shape), help.c_str());
  return *this;
}

Arguments& Arguments::value_or_flag(const std::string& name, const std::string& shape,
                                    const std::string& implied, const std::string& help) {
  groups_.back().add_options()(
      name.c_str(), po::value<std::string>()->value_name(shape)->implicit_value(implied, ""), help.c_str());
  return *this;
}

Arguments& Arguments::values(const std::string& name, const std::string& shape, const std::string& help) {
  groups_.back().add_options()(
      name.c_str(), po::value<std::vector<std::string>>()->composing()->value_name(shape), help.c_str());
  return *this;
}

Arguments& Arguments::hidden(const std::string& name, const std::string& shape) {
  hidden_.add_options()(name.c_str(), po::value<std::string>()->value_name(shape));
  return *this;
}

Arguments& Arguments::positional(const std::string& name, const std::string& help) {
  hidden_.add_options()(name.c_str(), po::value<std::string>(), help.c_str());
  positionals_.add(name.c_str(), 1);
  positional_help_.emplace_back(name, help);
  return *this;
}

std::string Arguments::take_word() {
  if (tokens_.empty() || tokens_[0].empty() || tokens_[0][0] == '-') return {};
  case_ = tokens_[0];
  tokens_.erase(tokens_.begin());
  return case_;
}

std::string Arguments::name() const { return case_.empty() ? who() : fmt::format("{} {}", who(), case_); }

// The command's own usage line tells of all its cases, and of none what it takes.
std::string Arguments::usage() const {
  if (case_.empty()) return fmt::format("usage: {} {}", who(), command_.usage);
  std::string line = "usage: " + name();
  for (const auto& [positional, help] : positional_help_) line += " " + positional;
  return line + " [options]";
}

bool Arguments::asks(const std::string& name, const std::string& value) const {
  for (std::size_t i = 0; i < tokens_.size(); ++i)
    if (tokens_[i] == option(name) + "=" + value ||
        (tokens_[i] == option(name) && i + 1 < tokens_.size() && tokens_[i + 1] == value))
      return true;
  return false;
}

OptionTable Arguments::table() const {
  OptionTable result{usage().substr(std::string("usage: ").size()), positional_help_, {}};
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (groups_[i].options().empty()) continue;
    OptionGroup group{titles_[i], {}};
    for (const auto& o : groups_[i].options()) {
      const std::string shown = o->canonical_display_name(po::command_line_style::allow_dash_for_short);
      group.options.push_back({"--" + o->long_name(), shown[0] == '-' ? shown : "",
                               o->semantic()->max_tokens() == 0 ? "" : o->semantic()->name(),
                               o->description()});
    }
    result.groups.push_back(std::move(group));
  }
  return result;
}

bool Arguments::parse() {
  if (asked_ != nullptr) {
    *asked_ = table();
    return false;
  }
  po::options_description all;
  for (const auto& g : groups_) all.add(g);
  all.add(hidden_);
  // No guessing: an abbreviation that works today would change its meaning with the next option.
  const int style = po::command_line_style::unix_style & ~po::command_line_style::allow_guessing;
  const auto given = [this](const char* word) {
    return std::find(tokens_.begin(), tokens_.end(), word) != tokens_.end();
  };
  if (given("--help-all") || given("--help") || given("-h")) {
    print_help(given("--help-all"));
    return false;
  }
  try {
    po::store(po::command_line_parser(tokens_).options(all).positional(positionals_).style(style).run(),
              values_);
  } catch (const po::too_many_positional_options_error&) {
    throw InputError(fmt::format("too many arguments; {}", usage()));
  } catch (const po::error& e) {
    throw InputError(fmt::format("{}; `{} --help` lists the options", e.what(), name()));
  }
  for (const auto& [positional, help] : positional_help_)
    if (!has(positional)) throw InputError(fmt::format("{} is missing; {}", positional, usage()));
  return true;
}

po::options_description Arguments::main_options() const {
  po::options_description chosen("Options", 110, 70);
  for (const auto& name : command_.main_options)
    for (const auto& g : groups_)
      for (const auto& o : g.options())
        if (o->long_name() == name) chosen.add(o);
  return chosen;
}

void Arguments::print_help(bool all) const {
  const auto print_group = [](const po::options_description& group) {
    std::ostringstream text;
    text << group;
    fmt::print("\n{}", text.str());
  };
  fmt::print("{}\n\n{}\n", usage(), command_.purpose);
  if (!positional_help_.empty()) fmt::print("\n");
  for (const auto& [positional, help] : positional_help_) fmt::print("  {:<10} {}\n", positional, help);
  std::size_t options = 0;
  for (const auto& g : groups_) options += g.options().size();
  const po::options_description chosen = main_options();
  const bool some = !all && !chosen.options().empty();
  if (some) print_group(chosen);
  for (const auto& g : groups_)
    if (!some && !g.options().empty()) print_group(g);
  if (!command_.examples.empty()) fmt::print("\nExamples:\n");
  for (const auto& [line, effect] : command_.examples) fmt::print("  {}\n      {}\n", line, effect);
  if (some)
    fmt::print("\n{} more options, by topic: {} --help-all\n", options - chosen.options().size(), name());
}

bool Arguments::has(const std::string& name) const { return values_.count(name) != 0; }

std::string Arguments::text(const std::string& name) const {
  if (!has(name)) throw InputError(fmt::format("{} is missing; {}", option(name), usage()));
  auto result = values_[name].as<std::string>();
  if (result.empty()) throw InputError(fmt::format("{} is empty", option(name)));
  return result;
}

std::vector<std::string> Arguments::texts(const std::string& name) const {
  return has(name) ? values_[name].as<std::vector<std::string>>() : std::vector<std::string>{};
}

std::string Arguments::text_or(const std::string& name, const std::string& fallback) const {
  return has(name) ? text(name) : fallback;
}

std::optional<double> Arguments::number(const std::string& name) const {
  if (!has(name)) return std::nullopt;
  return parse_number(option(name), text(name));
}

double Arguments::number_or(const std::string& name, double fallback) const {
  return number(name).value_or(fallback);
}

double Arguments::positive_or(const std::string& name, double fallback) const {
  const double result = number_or(name, fallback);
  if (!(result > 0)) throw InputError(fmt::format("{}: {} is not above 0", option(name), result));
  return result;
}

std::optional<std::int64_t> Arguments::integer(const std::string& name) const {
  if (!has(name)) return std::nullopt;
  return parse_integer(option(name), text(name));
}

std::int64_t Arguments::integer_or(const std::string& name, std::int64_t fallback, std::int64_t lowest,
                                   std::int64_t highest) const {
  const std::int64_t result = integer(name).value_or(fallback);
  if (result < lowest || result > highest)
    throw InputError(fmt::format("{}: {} is not between {} and {}", option(name), result, lowest, highest));
  return result;
}

std::optional<std::vector<double>> Arguments::numbers(const std::string& name, std::size_t count) const {
  if (!has(name)) return std::nullopt;
  const auto parts = split(text(name), ',');
  if (count != 0 && parts.size() != count)
    throw InputError(
        fmt::format("{}: '{}' is not {} numbers separated by commas", option(name), text(name), count));
  std::vector<double> result;
  result.reserve(parts.size());
  for (const auto& part : parts) result.push_back(parse_number(option(name), part));
  return result;
}

std::optional<std::array<double, 2>> Arguments::one_or_two(const std::string& name) const {
  if (!has(name)) return std::nullopt;
  const auto values = *numbers(name, text(name).find(',') == std::string::npos ? 1 : 2);
  if (!(values.front() > 0 && values.back() > 0))
    throw InputError(fmt::format("{}: {} is not above 0", option(name), text(name)));
  return std::array{values.front(), values.back()};
}

std::optional<Vec3> Arguments::vec3(const std::string& name) const {
  const auto values = numbers(name, 3);
  if (!values) return std::nullopt;
  return Vec3{(*values)[0], (*values)[1], (*values)[2]};
}

std::optional<std::vector<std::int64_t>> Arguments::sizes(const std::string& name, std::size_t count) const {
  if (!has(name)) return std::nullopt;
  const auto parts = split(text(name), 'x');
  if (parts.size() != count)
    throw InputError(
        fmt::format("{}: '{}' is not {} sizes separated by 'x'", option(name), text(name), count));
  std::vector<std::int64_t> result;
  for (const auto& part : parts) {
    result.push_back(parse_integer(option(name), part));
    // Sides beyond 2^30 overflow products in places where no message could name the option any more.
    if (result.back() < 1 || result.back() > (std::int64_t{1} << 30))
      throw InputError(
          fmt::format("{}: {} is not between 1 and {}", option(name), part, std::int64_t{1} << 30));
  }
  return result;
}

std::string Arguments::choice(const std::string& name, const std::string& fallback) const {
  if (!has(name)) return fallback;
  const auto* declared = hidden_.find_nothrow(name, /*approx=*/false);
  for (const auto& g : groups_)
    if (!declared) declared = g.find_nothrow(name, /*approx=*/false);
  if (declared) return choice(name, split(declared->semantic()->name(), '|'), fallback);
  throw std::logic_error("choice: --" + name + " is not declared");
}

std::string Arguments::choice(const std::string& name, const std::vector<std::string>& allowed,
                              const std::string& fallback) const {
  std::string result = text_or(name, fallback);
  if (std::find(allowed.begin(), allowed.end(), result) == allowed.end())
    throw InputError(
        fmt::format("{}: '{}' is not one of: {}", option(name), result, fmt::join(allowed, ", ")));
  return result;
}

}  // namespace vdvr::cli
