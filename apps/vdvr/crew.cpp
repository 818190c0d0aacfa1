#include "apps/vdvr/crew.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <numeric>

#include "apps/common/progress.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr::cli {
namespace {

Messenger* the_messenger = nullptr;

std::chrono::seconds the_patience = CrewOptions{}.give_up;

constexpr std::int64_t longest_wait = 86400;

}  // namespace

std::vector<std::string> device_selectors(const std::string& text) {
  std::vector<std::string> out;
  if (text == "all") {
    for (const DeviceInfo& info : Device::list()) out.push_back(std::to_string(info.index));
    return out.empty() ? std::vector<std::string>{""} : out;
  }
  // A name may hold a comma; numbers do not.
  const bool list = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isdigit(c) != 0 || c == ',';
  });
  if (!list) return {text};
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find(',', from), text.size());
    if (end == from)
      throw InputError(fmt::format("--device: '{}' has an empty entry; write 0,1 or all", text));
    out.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return out;
}

void add_crew(Arguments& args) {
  args.group("Several devices (--device 0,1 or all)")
      .flag("mixed-devices",
            "devices may differ: the certificate names all and charges the worst, and the same bytes are not "
            "promised");
  add_give_up(args, "its blocks are computed elsewhere");
}

void add_give_up(Arguments& args, const std::string& what) {
  args.value("give-up", "SECONDS",
             fmt::format("after so long without a sign of life a process is given up, and {} (default {})",
                         what, CrewOptions{}.give_up.count()));
}

std::chrono::seconds give_up_option(const Arguments& args) {
  the_patience =
      std::chrono::seconds(args.integer_or("give-up", CrewOptions{}.give_up.count(), 1, longest_wait));
  return the_patience;
}

std::string first_device(const Arguments& args) {
  return device_selectors(args.text_or("device", "")).front();
}

void set_messenger(Messenger* messenger) { the_messenger = messenger; }

Messenger* frames_messenger() { return the_messenger; }
int processes_here() { return the_messenger ? std::max(1, the_messenger->neighbours()) : 1; }
std::chrono::seconds patience_with_others() { return the_patience; }
int place_here() { return the_messenger ? the_messenger->place() : 0; }

Devices::Devices(const Arguments& args, const CommonOptions& common) {
  options_.messenger = the_messenger;
  options_.mixed_devices = args.has("mixed-devices");
  options_.give_up = give_up_option(args);
  const std::string who = args.who();
  options_.say = [who](const std::string& text) { say(fmt::format("{}: {}\n", who, text)); };
  std::vector<std::string> all = device_selectors(common.device);
  std::uint64_t sharing = all.size();
  if (the_messenger) {
    // Each process takes one of the list, this one the first.
    options_.device_of_others = all.front();
    for (std::size_t i = 1; i < all.size(); ++i) options_.device_of_others += "," + all[i];
    options_.memory_of_others = args.has("max-memory") ? common.max_memory : 0;
    options_.scratch_of_others = common.scratch.string();
    all.resize(1);
    sharing = static_cast<std::uint64_t>(the_messenger->neighbours());
  }
  for (const std::string& selector : all) {
    devices_.push_back(std::make_unique<Device>(selector, common.max_memory / sharing));
    require_trusted(*devices_.back(), "certifying a volume");
  }
}

CrewOptions Devices::crew() {
  wake(first(), options_);
  CrewOptions options = options_;
  for (std::size_t i = 1; i < devices_.size(); ++i) options.devices.push_back(devices_[i].get());
  return options;
}

std::uint64_t Devices::peak_memory() const {
  return std::accumulate(devices_.begin(), devices_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const auto& device) { return sum + device->peak_memory(); });
}

std::optional<BuildShare> share_option(const Arguments& args) {
  if (!args.has("share")) return std::nullopt;
  const std::string text = args.text("share");
  BuildShare share;
  const char* end = text.data() + text.size();
  auto read = std::from_chars(text.data(), end, share.part);
  const bool slash = read.ec == std::errc() && read.ptr != end && *read.ptr == '/';
  if (slash) read = std::from_chars(read.ptr + 1, end, share.parts);
  if (!slash || read.ec != std::errc() || read.ptr != end || share.part < 1 || share.part > share.parts)
    throw InputError(fmt::format("--share: '{}' is not k/N with 1 <= k <= N, as 2/3", text));
  return share;
}

std::filesystem::path share_path(const std::filesystem::path& output, const BuildShare& share) {
  return fmt::format("{}.share-{}-of-{}.journal", output.string(), share.part, share.parts);
}

std::vector<std::filesystem::path> shares_of(const std::filesystem::path& output) {
  const auto folder = output.has_parent_path() ? output.parent_path() : std::filesystem::path(".");
  const std::string begin = output.filename().string() + ".share-", end = ".journal";
  std::vector<std::filesystem::path> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && name.ends_with(end)) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace vdvr::cli
