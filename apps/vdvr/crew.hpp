// The devices and processes that a build is spread over, and its shares.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/common_options.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/crew.hpp"

namespace vdvr::cli {

/// --mixed-devices and --give-up.
void add_crew(Arguments& args);
/// --give-up alone, of what other processes do `what`, and its value.
void add_give_up(Arguments& args, const std::string& what);
std::chrono::seconds give_up_option(const Arguments& args);

/// To the other processes of this program; none: it is alone. Set before a command runs.
void set_messenger(Messenger* messenger);

/// What render uses of it: none where this process is alone, or follows (frames.hpp).
Messenger* frames_messenger();
/// Processes of this program on this machine, which share --max-memory, and the place of this one.
int processes_here();
int place_here();
/// After how long without a sign of life a process is given up: --give-up of the command that ran.
std::chrono::seconds patience_with_others();

/// What each of the devices that --device names is opened with: of "0,1" or "all" several. Throws InputError.
std::vector<std::string> device_selectors(const std::string& text);

/// Of --device, what a command that takes one device would be given; empty: the default.
std::string first_device(const Arguments& args);

/// What --device names: one, or several as "0,1" or "all".
class Devices {
 public:
  /// --max-memory is shared among those of this machine.
  Devices(const Arguments& args, const CommonOptions& common);
  [[nodiscard]] Device& first() { return *devices_.front(); }
  /// The others, of this process and of others; these wake up.
  [[nodiscard]] CrewOptions crew();
  [[nodiscard]] std::uint64_t peak_memory() const;

 private:
  CrewOptions options_;
  std::vector<std::unique_ptr<Device>> devices_;
};

/// Of --share k/N.
std::optional<BuildShare> share_option(const Arguments& args);
/// The journal of a share of an output.
std::filesystem::path share_path(const std::filesystem::path& output, const BuildShare& share);
/// Those that are there.
std::vector<std::filesystem::path> shares_of(const std::filesystem::path& output);

}  // namespace vdvr::cli
