// Frame f is drawn by process f mod N. The leader makes the folder, tells the others, draws its own, waits
// until the others say that they are done, or are gone or given up, and draws what is missing: a frame is a
// file that is whole or not there, so that the folder alone says what is done. All processes see one folder.
#include "apps/vdvr/frames.hpp"

#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <set>
#include <span>
#include <sstream>
#include <vector>

#include "apps/vdvr/crew.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/stop.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

constexpr const char* kGo = "vdvr frames: the folder is there";
constexpr const char* kDone = "vdvr frames: done";
constexpr const char* kRecord = "turntable.json";

Messenger* the_leader = nullptr;  // of a process that follows
int the_rank = 0;

std::vector<std::byte> message_of(const char* text) {
  const auto bytes = std::as_bytes(std::span(text, std::char_traits<char>::length(text)));
  return {bytes.begin(), bytes.end()};
}

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

std::string content_of(const fs::path& path) {
  const std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (file) text << file.rdbuf();
  return text.str();
}

/// Frames that an earlier, longer turn may have left in the folder go with it.
std::vector<std::string> names_of(const FramesOptions& o) {
  std::vector<std::string> names;
  for (std::int64_t f = 0; f < o.frames; ++f) names.push_back(frame_name(f));
  for (std::int64_t f = o.frames; f <= 9999 && is_there(o.folder / frame_name(f)); ++f)
    names.push_back(frame_name(f));
  if (o.certificate) names.emplace_back("certificate.json");
  return names;
}

template <class Draw>
std::int64_t draw_missing(const FramesOptions& o, std::int64_t first, std::int64_t step, const Draw& draw) {
  std::int64_t drawn = 0;
  for (std::int64_t f = first; f < o.frames; f += step) {
    const fs::path path = o.folder / frame_name(f);
    if (is_there(path)) continue;
    draw(f, path);
    ++drawn;
  }
  return drawn;
}

std::int64_t frames_there(const FramesOptions& o) {
  std::int64_t count = 0;
  for (std::int64_t f = 0; f < o.frames; ++f) count += is_there(o.folder / frame_name(f)) ? 1 : 0;
  return count;
}

// A frame that comes to lie in the folder is a sign of life. Without one for long, those that have not said
// that they are done are given up: what they were to draw is drawn here.
void wait_for_others(Messenger& messenger, const FramesOptions& o) {
  using Clock = std::chrono::steady_clock;
  std::set<int> busy;
  for (int process = 1; process <= messenger.others(); ++process) busy.insert(process);
  const std::vector<std::byte> done = message_of(kDone);
  auto heard = Clock::now();
  std::int64_t there = frames_there(o);
  while (!busy.empty()) {
    throw_if_stopped();
    if (const auto message = messenger.receive(std::chrono::milliseconds(200));
        message && message->second == done) {
      busy.erase(message->first);
      heard = Clock::now();
    }
    std::erase_if(busy, [&](int process) { return messenger.is_gone(process); });
    if (const std::int64_t now = frames_there(o); now != there) {
      there = now;
      heard = Clock::now();
    }
    if (Clock::now() - heard <= patience_with_others()) continue;
    for (const int process : busy) messenger.give_up(process);
    return;
  }
}

}  // namespace

std::string frame_name(std::int64_t frame) { return fmt::format("frame-{:04}.png", frame); }

FramesDrawn draw_frames(const FramesOptions& o,
                        const std::function<void(std::int64_t, const fs::path&)>& draw,
                        const std::function<void(OutputFolder&)>& finish) {
  FramesDrawn result;
  Messenger* others = the_leader ? nullptr : frames_messenger();
  if (the_leader) {
    result.drawn = draw_missing(o, the_rank, the_leader->others() + 1, draw);
    return result;
  }
  const std::vector<std::string> names = names_of(o);
  const fs::path record = o.folder / kRecord;
  const bool resumes = o.resume && !is_there(o.folder / "certificate.json") && content_of(record) == o.key;
  OutputFolder folder(o.folder, names, o.force || resumes);
  if (!resumes) folder.begin();
  for (std::int64_t f = 0; f < o.frames; ++f) result.kept += is_there(o.folder / frame_name(f)) ? 1 : 0;
  io::write_file(record, o.key);
  const std::int64_t processes = others ? others->others() + 1 : 1;
  for (int process = 1; process < processes; ++process) others->send(process, message_of(kGo));
  result.drawn = draw_missing(o, 0, processes, draw);
  if (others) wait_for_others(*others, o);
  result.drawn += draw_missing(o, 0, 1, draw);
  finish(folder);
  std::error_code ignored;
  fs::remove(record, ignored);
  return result;
}

bool wait_for_frames(Messenger& messenger) {
  const std::vector<std::byte> go = message_of(kGo);
  while (!messenger.is_gone(0)) {
    const auto message = messenger.receive(std::chrono::milliseconds(200));
    // Whatever else the leader says, it says at the end.
    if (message) return message->second == go;
    if (stop_requested() != 0) return false;
  }
  return false;
}

void follow_frames(Messenger& messenger, int rank) {
  the_leader = &messenger;
  the_rank = rank;
}

void end_frames(Messenger& messenger) { messenger.send(0, message_of(kDone)); }

}  // namespace vdvr::cli
