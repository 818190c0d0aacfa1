#include "apps/common/command.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <new>

#include "apps/common/arguments.hpp"
#include "apps/common/messages.hpp"
#include "apps/common/progress.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr::cli {
namespace {

/// Errors of usage and input are one line each; a build log or a list of devices may take more.
std::string as_message(const Error& error) {
  std::string text = with_options(error.what());
  if (exit_code_of(error) > 2) return text;
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) text.replace(at, 1, " ");
  return text;
}

}  // namespace

/// What fails once a stop was requested fails for that: a compiler whose files its own handler removed.
int fail(const std::string& who, std::string message, int code) {
  if (const int stop = stop_requested(); stop != 0 && stop != code) {
    message = "interrupted";
    code = stop;
  }
  say(fmt::format("{}: {}\n", who, message));
  return code;
}

int run_guarded(const Command& command, std::vector<std::string> words) {
  const std::string who = command.who();
  try {
    catch_signals(who);
    tell_of_devices(
        [who](const std::string& line) { say(fmt::format("{}: {}\n", who, with_options(line))); });
    Arguments args(command, std::move(words));
    const int code = command.run(args);
    if (std::fflush(stdout) != 0) return fail(who, "standard output cannot be written", 3);
    return code;
  } catch (const Error& e) {
    return fail(who, as_message(e), exit_code_of(e));
  } catch (const std::bad_alloc&) {
    return fail(who, "out of memory; choose a smaller --size, or set --max-memory", 3);
  } catch (const std::exception& e) {
    return fail(who, words_for(e), 3);
  }
}

}  // namespace vdvr::cli
