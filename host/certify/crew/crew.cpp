// Leads a crew: cuts a pass into pieces, hands them out, collects records, and gives the blocks of a lost
// worker to others.
#include "host/certify/crew/crew.hpp"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "host/base/system/casts.hpp"
#include "host/certify/crew/crew_messages.hpp"
#include "host/certify/crew/crew_worker.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

using Clock = std::chrono::steady_clock;

// A worker has as many pieces at once: one to compute, one to go on with, but for the last ones.
constexpr std::size_t ahead = 2;
// Of what is left of a worker's part each piece takes so much: large ones, whose blocks share batches, then
// smaller ones, so that all end together. The least is a part of that part, or takes milliseconds.
constexpr double piece_of_rest = 0.2, least_of_part = 1.0 / 32, least_samples = 1 << 18;

bool is_same(const DeviceInfo& a, const DeviceInfo& b) {
  return a.name == b.name && a.driver == b.driver && a.platform == b.platform;
}

// Runs of blocks in their order, of about equal cost, one for each worker, in pieces.
std::vector<std::vector<Works>> cut(const GoldStream& gold, const Works& works, std::size_t workers) {
  double total = 0;
  for (const GoldStream::Work& w : works) total += gold.cost(w);
  const double part = std::max(total / static_cast<double>(workers), least_samples),
               least = std::max(part * least_of_part, std::min(part, least_samples));
  std::vector<std::vector<Works>> runs(1);
  double left = part, room = 0;  // of the run, of the piece
  for (const GoldStream::Work& w : works) {
    const double block = gold.cost(w) / static_cast<double>(w.first.size());
    for (std::size_t from = 0; from < w.first.size();) {
      if (left < 0.5 * block && runs.size() < workers) {
        runs.emplace_back();
        left += part;
        room = 0;
      }
      if (room < 0.5 * block || runs.back().empty()) {
        runs.back().emplace_back();
        room = std::max(left * piece_of_rest, least);
      }
      const auto n =
          std::min(w.first.size() - from, static_cast<std::size_t>(std::max(1.0, std::round(room / block))));
      GoldStream::Work some = w;
      some.first.assign(w.first.begin() + static_cast<std::ptrdiff_t>(from),
                        w.first.begin() + static_cast<std::ptrdiff_t>(from + n));
      runs.back().back().push_back(std::move(some));
      room -= static_cast<double>(n) * block;
      left -= static_cast<double>(n) * block;
      from += n;
    }
  }
  return runs;
}

// Takes the blocks of a record away from a piece.
void take_away(Works& works, const Bytes& record) {
  ByteReader in(record);
  const BlockKey key = get_key(in);
  for (GoldStream::Work& w : works)
    if (w.z == key.z && w.size() == key.size)
      std::erase_if(w.first, [&](const auto& block) {
        return std::find(key.first.begin(), key.first.end(), block) != key.first.end();
      });
  std::erase_if(works, [](const GoldStream::Work& w) { return w.first.empty(); });
}

}  // namespace

void CrewInbox::put(CrewReport report) {
  {
    const std::lock_guard guard(lock_);
    reports_.push_back(std::move(report));
  }
  arrived_.notify_one();
}

std::optional<CrewReport> CrewInbox::take(std::chrono::milliseconds wait) {
  std::unique_lock guard(lock_);
  if (!arrived_.wait_for(guard, wait, [&] { return !reports_.empty(); })) return std::nullopt;
  CrewReport report = std::move(reports_.front());
  reports_.pop_front();
  return report;
}

struct Crew::State {
  struct Member {
    std::unique_ptr<CrewWorker> worker;
    int process = 0;  // of another one
    bool lost = false;
    Clock::time_point heard = Clock::now();
    std::map<std::size_t, Works> given;  // pieces, less what came back of them
  };

  const CrewOptions& options;
  CrewInbox inbox;
  LeadersDevice leader;
  std::vector<std::unique_ptr<OtherDevice>> others;
  std::vector<Member> members;
  CrewTraffic traffic;
  std::uint64_t passes = 0;
  bool has_told = false;  // what is left out of bricks that the plan looked at

  State(opencl::State& device, const CrewOptions& o) : options(o), leader(device) {}

  RemoteWorker& remote(Member& m) const { return static_cast<RemoteWorker&>(*m.worker); }
  void say(const std::string& text) const {
    if (options.say) options.say(text);
  }
  void lose(Member& m, const std::string& why) {
    m.lost = true;
    say(fmt::format("process {} {}: its blocks are given to others", m.process, why));
    options.messenger->give_up(m.process);
  }
  [[nodiscard]] std::optional<std::pair<CrewReport, Bytes>> take_message(std::chrono::milliseconds wait);
  [[nodiscard]] std::optional<CrewReport> take();
};

// Hello and ready come with the bytes that follow.
std::optional<std::pair<CrewReport, Bytes>> Crew::State::take_message(std::chrono::milliseconds wait) {
  if (!options.messenger) return std::nullopt;
  const auto start = Clock::now();
  auto message = options.messenger->receive(wait);
  if (!message) return std::nullopt;
  traffic.bytes += message->second.size();
  if (wait.count() == 0) traffic.seconds += std::chrono::duration<double>(Clock::now() - start).count();
  const auto from = std::find_if(members.begin(), members.end(),
                                 [&](const Member& m) { return m.process == message->first; });
  if (from == members.end() || from->lost) return std::nullopt;
  from->heard = Clock::now();
  ByteReader in(message->second);
  CrewReport report{static_cast<std::size_t>(from - members.begin()), CrewReport::Kind::alive, 0, 0, {}, {}};
  const auto word = in.get<CrewWord>();
  Bytes rest;
  if (word == CrewWord::record || word == CrewWord::done) {
    report.kind = word == CrewWord::done ? CrewReport::Kind::done : CrewReport::Kind::record;
    report.pass = in.get<std::uint64_t>();
    report.piece = in.get<std::uint64_t>();
    if (word == CrewWord::record) report.record = in.get<Bytes>();
  } else if (word == CrewWord::failed) {
    report.kind = CrewReport::Kind::failed;
    lose(*from, "failed: " + in.get<std::string>());
  } else if (word == CrewWord::hello || word == CrewWord::ready) {
    rest.assign(message->second.begin() + 1, message->second.end());
  }
  return std::pair{std::move(report), std::move(rest)};
}

std::optional<CrewReport> Crew::State::take() {
  constexpr std::chrono::milliseconds none{0}, a_moment{2};
  if (auto message = take_message(none)) return std::move(message->first);
  return inbox.take(a_moment);
}

Crew::Crew(Device& leader, PreparedScan& from, const GoldSettings& settings, const CrewOptions& options,
           bool all)
    : state_(std::make_unique<State>(leader.state(), options)) {
  State& s = *state_;
  leader.state().on_program = nullptr;  // wake()
  kinds_.push_back({leader.info(), probe_filters(leader), 0});
  s.members.emplace_back().worker = std::make_unique<ThreadWorker>(s.inbox, 0, s.leader);
  for (Device* device : options.devices) {
    auto& other = s.others.emplace_back(std::make_unique<OtherDevice>(device->state(), from, settings));
    if (options.mixed_devices && !is_same(device->info(), leader.info()))
      kinds_.push_back({device->info(), probe_filters(*device), other->arithmetic()});
    else if (!is_same(device->info(), leader.info())) kinds_.push_back({device->info(), {}, 0});
    const std::size_t index = s.members.size();
    s.members.emplace_back().worker = std::make_unique<ThreadWorker>(s.inbox, index, *other);
  }
  if (options.messenger) {
    Messenger& messenger = *options.messenger;
    for (int process = 1; process <= messenger.others(); ++process) {
      State::Member& m = s.members.emplace_back();
      m.process = process;
      m.worker = std::make_unique<RemoteWorker>(messenger, process, s.traffic);
      s.remote(m).send(message_to_open(CrewWord::open, options));
    }
    const std::span<const float> samples(from.filtered.samples.data(), from.filtered.samples.size());
    const std::uint64_t lent = messenger.others() > 0 ? messenger.lend(std::as_bytes(samples)) : 0;
    const std::uint64_t common = all && messenger.others() > 0 ? pool_gold(from, settings, lent) : 0;
    for (State::Member& m : s.members) {
      if (!m.worker->is_remote()) continue;
      s.remote(m).send(message_of(CrewWord::scan, lent, std::uint64_t{samples.size()}, options.mixed_devices,
                                  common, from.filtered, from.sups, settings));
    }
    wait_for_kinds();
  } else if (all) {
    pool_gold(from, settings, 0);
  }
  if (options.mixed_devices || kinds_.size() == 1) return;
  throw InputError(fmt::format(
      "`device`: '{}' and '{}' are not the same device and driver, whose results may differ; take devices of "
      "one kind, or --mixed-devices",
      kinds_[0].info.name, kinds_[1].info.name));
}

namespace {

CommonMemory memory_of_threads(std::uint64_t bytes, int sharers) {
  void* first =
      ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (first == MAP_FAILED) return {};
  return {{static_cast<std::byte*>(first), bytes},
          std::shared_ptr<void>(first, [bytes](void* p) { ::munmap(p, bytes); }),
          sharers};
}

}  // namespace

// Where devices compute in the host's memory, gold is kept once for those of a machine, and made by all of
// them; processes of other machines do so among themselves. Returns the number by which processes ask for
// such memory, 0 where they must not.
std::uint64_t Crew::pool_gold(PreparedScan& from, const GoldSettings& settings, std::uint64_t number) {
  State& s = *state_;
  // What a device made, others of another kind would read.
  if (s.options.mixed_devices) return 0;
  const int sharers =
      s.options.messenger ? s.options.messenger->neighbours() : static_cast<int>(s.members.size());
  if (sharers == 1) return number;
  KeptGold& kept = from.source(settings)->kept;
  const auto shape = kept.common_shape();
  const std::uint64_t bytes = shape ? CommonGold::bytes_of(*shape) : 0;
  if (!shape || bytes / count(sharers) > from.state.memory.left() / 2) return 0;
  const CommonMemory memory =
      s.options.messenger ? s.options.messenger->common(number, bytes) : memory_of_threads(bytes, sharers);
  if (memory.bytes.empty()) return 0;
  kept.share(memory, true);
  for (const auto& other : s.others) other->pool_gold([memory](std::uint64_t) { return memory; });
  return number;
}

// What devices the others have. They answer while the scan is still on its way to them.
void Crew::wait_for_kinds() {
  State& s = *state_;
  std::vector<std::uint8_t> known(s.members.size(), 0);
  const auto is_missing = [&](std::size_t i) {
    return s.members[i].worker->is_remote() && !s.members[i].lost && !known[i];
  };
  const auto begin = Clock::now();
  for (;;) {
    throw_if_stopped();
    bool missing = false;
    for (std::size_t i = 0; i < known.size(); ++i) {
      if (!is_missing(i)) continue;
      if (s.options.messenger->is_gone(s.members[i].process)) s.lose(s.members[i], "ended");
      else if (Clock::now() - std::max(begin, s.members[i].heard) > s.options.give_up)
        s.lose(s.members[i], "did not answer in time");
      else missing = true;
    }
    if (!missing) return;
    const auto message = s.take_message(std::chrono::milliseconds(50));
    if (!message || message->second.empty()) continue;
    ByteReader in(message->second);
    const auto kind = in.get<Kind>();
    if (s.options.mixed_devices && kind.arithmetic == 0) continue;  // hello; more is known when it is ready
    known[message->first.worker] = 1;
    if (std::none_of(kinds_.begin(), kinds_.end(), [&](const Kind& k) { return is_same(k.info, kind.info); }))
      kinds_.push_back(kind);
  }
}

Crew::~Crew() {
  for (State::Member& m : state_->members) {
    if (m.lost) continue;
    try {
      m.worker->halt();
    } catch (...) {  // what carries messages is gone: so are the others
    }
  }
}

std::uint64_t Crew::bytes() const { return state_->traffic.bytes; }
double Crew::message_seconds() const { return state_->traffic.seconds; }

void Crew::use(const MixedVolume& volume, const MemoryBudget& budget) {
  for (State::Member& m : state_->members)
    if (!m.lost) m.worker->use(volume, budget);
  // No pass need follow before the caller changes it.
  for (State::Member& m : state_->members)
    if (!m.worker->is_remote()) m.worker->halt();
}

namespace {

// Pieces in the order of blocks, a run of them to each worker, who so reads gold of one region in all passes;
// whoever has done its own takes from the end of the longest that is left.
class Queue {
 public:
  Queue(std::vector<std::vector<Works>> runs, std::size_t workers) : runs_(workers) {
    for (std::size_t w = 0; w < workers; ++w) {
      runs_[w].first = pieces_.size();
      if (w < runs.size())
        for (Works& piece : runs[w]) pieces_.push_back(std::move(piece));
      runs_[w].last = pieces_.size();
    }
  }
  [[nodiscard]] std::size_t left() const {
    std::size_t pieces = returned_.size();
    for (const Run& run : runs_) pieces += run.last - run.first;
    return pieces;
  }
  std::optional<std::size_t> next(std::size_t worker) {
    if (!returned_.empty()) {
      const std::size_t piece = returned_.back();
      returned_.pop_back();
      return piece;
    }
    Run& own = runs_[worker];
    if (own.first < own.last) return own.first++;
    Run& longest = *std::max_element(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) {
      return a.last - a.first < b.last - b.first;
    });
    if (longest.first == longest.last) return std::nullopt;
    return --longest.last;
  }
  [[nodiscard]] const Works& works(std::size_t piece) const { return pieces_[piece]; }
  void give_back(Works works) {
    pieces_.push_back(std::move(works));
    returned_.push_back(pieces_.size() - 1);
  }

 private:
  struct Run {
    std::size_t first = 0, last = 0;
  };
  std::vector<Works> pieces_;
  std::vector<Run> runs_;
  std::vector<std::size_t> returned_;
};

}  // namespace

void Crew::run(GoldStream& gold, const SharedPass& pass, const DeviceField* field, Works works,
               const OnRecord& on_record, const Progress& progress, const std::string& stage) {
  if (works.empty()) return;
  State& s = *state_;
  const std::uint64_t number = ++s.passes;
  std::size_t blocks = 0;
  for (const GoldStream::Work& w : works) blocks += w.first.size();
  std::size_t left = blocks;
  Queue queue(cut(gold, works, s.members.size()), s.members.size());
  s.leader.set(gold, field);
  const auto feed = [&](std::size_t i) {
    State::Member& m = s.members[i];
    while (!m.lost && m.given.size() < (queue.left() >= s.members.size() ? ahead : 1)) {
      const auto piece = queue.next(i);
      if (!piece) return;
      if (m.given.empty()) m.heard = Clock::now();
      m.given[*piece] = queue.works(*piece);
      m.worker->give(number, *piece, queue.works(*piece));
    }
  };
  const auto take_back = [&](State::Member& m) {
    for (auto& [piece, rest] : std::exchange(m.given, {}))
      if (!rest.empty()) queue.give_back(std::move(rest));
    for (std::size_t i = 0; i < s.members.size(); ++i) feed(i);
  };
  try {
    for (State::Member& m : s.members) {
      m.given.clear();
      if (!m.lost) m.worker->begin(number, pass);
    }
    for (std::size_t i = 0; i < s.members.size(); ++i) feed(i);
    while (left > 0) {
      throw_if_stopped();
      const auto report = s.take();
      for (State::Member& m : s.members) {
        if (m.worker->is_remote() && !m.lost) {
          if (s.options.messenger->is_gone(m.process)) s.lose(m, "ended");
          else if (!m.given.empty() && Clock::now() - m.heard > s.options.give_up)
            s.lose(m, fmt::format("gave no sign for {} s", s.options.give_up.count()));
        }
        if (m.lost && !m.given.empty()) take_back(m);
      }
      if (!report) continue;
      State::Member& m = s.members[report->worker];
      if (report->error) std::rethrow_exception(report->error);
      const auto given = m.given.find(report->piece);
      if (report->pass != number || given == m.given.end()) continue;
      if (report->kind == CrewReport::Kind::record) {
        ByteReader in(report->record);
        const std::size_t n = get_key(in).first.size();
        take_away(given->second, report->record);
        on_record(report->record);
        left -= std::min(left, n);
        vdvr::report(progress, stage, 1 - static_cast<double>(left) / static_cast<double>(blocks));
      } else if (report->kind == CrewReport::Kind::done) {
        m.given.erase(given);
        feed(report->worker);
      }
    }
  } catch (...) {
    for (State::Member& m : s.members)
      if (!m.lost) m.worker->halt();
    throw;
  }
  for (State::Member& m : s.members)
    if (!m.worker->is_remote()) m.worker->halt();  // what ends a piece reads the caller's streams
}

void Crew::look_at(GoldStream& gold, const std::vector<std::uint8_t>& selected, const Progress& progress) {
  State& s = *state_;
  BrickRemainder& remainder = *gold.source()->remainder;
  const std::vector<BrickRemainder::Block> open = remainder.open(selected);
  if (open.empty()) return;
  BlockPass pass;
  pass.ask = BlockPass::Ask::remainder;
  pass.rate = gold.settings().rate;
  pass.lattice = gold.settings().lattice;
  pass.selected = selected;
  const auto shared = std::make_shared<const BlockPass>(std::move(pass));
  const auto records = std::make_shared<std::vector<Bytes>>();
  // What the plan found, once.
  if (!std::exchange(s.has_told, true))
    for (const BrickRemainder::Block& block : remainder.known())
      records->push_back(remainder_record(remainder, block, *shared, gold.settings().rate));
  run(
      gold, shared, nullptr, works_of(open), [&](const Bytes& record) { records->push_back(record); },
      progress, "remainder");
  for (const Bytes& record : *records) {
    ByteReader in(record);
    const BlockKey key = get_key(in);
    take_remainder(in, key, remainder);
  }
  for (State::Member& m : s.members)
    if (!m.lost) m.worker->learn(records);
}

void run_blocks(Crew* crew, GoldStream& gold, const SharedPass& pass, const DeviceField* field, Works works,
                const OnRecord& on_record, const Progress& progress, const std::string& stage) {
  if (works.empty()) return;
  if (crew) {
    crew->run(gold, pass, field, std::move(works), on_record, progress, stage);
    return;
  }
  const opencl::DeviceArray<std::uint8_t> selected(
      gold.state(), std::span<const std::uint8_t>(pass->selected), "bricks of a pass");
  compute_blocks(
      gold, *pass, field, selected, works, [&](const Bytes& record) { on_record(record); }, progress, stage);
}

}  // namespace vdvr
