// The other side of a crew: a process that computes blocks for the one that leads (crew_messages.hpp).
#include <chrono>
#include <cstring>
#include <deque>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "host/certify/crew/crew_member.hpp"
#include "host/certify/crew/crew_messages.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/crew.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int leader = 0;
// Between signs of life.
constexpr std::chrono::milliseconds alive_every{500};

// One of "0,1,2", the whole of anything else.
std::string device_of(const std::string& list, int place) {
  std::vector<std::string> parts{""};
  for (const char c : list) {
    if (c == ',') parts.emplace_back();
    else parts.back() += c;
  }
  return parts[static_cast<std::size_t>(place) % parts.size()];
}

class CrewProcess {
 public:
  explicit CrewProcess(Messenger& messenger) : messenger_(messenger) {}

  void run() {
    for (;;) {
      Bytes message = next();
      ByteReader in(message);
      const auto word = in.get<CrewWord>();
      if (word == CrewWord::dismiss) break;
      if (failed_ && word != CrewWord::open) continue;
      try {
        obey(word, in);
      } catch (const Interrupted&) {
        throw;
      } catch (const std::exception& e) {
        failed_ = std::current_exception();
        messenger_.send(leader, message_of(CrewWord::failed, std::string(e.what())));
      }
    }
    if (failed_) std::rethrow_exception(failed_);
  }

 private:
  // What has arrived, so that what is no longer wanted is not begun; of a field's samples a few at a time.
  void gather(std::chrono::milliseconds wait) {
    std::uint64_t bytes = 0;
    for (const Bytes& message : queue_) bytes += message.size();
    while (bytes < 2 * part_bytes) {
      auto message = messenger_.receive(wait);
      if (!message) return;
      bytes += message->second.size();
      queue_.push_back(std::move(message->second));
      wait = std::chrono::milliseconds(0);
    }
  }
  Bytes next() {
    gather(std::chrono::milliseconds(0));
    while (queue_.empty()) {
      throw_if_stopped();
      gather(std::chrono::milliseconds(50));
    }
    Bytes message = std::move(queue_.front());
    queue_.pop_front();
    return message;
  }
  [[nodiscard]] bool is_halted() const {
    return std::any_of(queue_.begin(), queue_.end(), [](const Bytes& message) {
      const auto word = static_cast<CrewWord>(message.at(0));
      return word == CrewWord::halt || word == CrewWord::pass || word == CrewWord::scan ||
             word == CrewWord::dismiss;
    });
  }

  void obey(CrewWord word, ByteReader& in) {
    switch (word) {
      case CrewWord::wake:
        return wake_up(in);
      case CrewWord::warm:
        return warm(in);
      case CrewWord::open:
        return open(in);
      case CrewWord::scan:
        return take_scan(in);
      case CrewWord::field:
        return take_field(in);
      case CrewWord::part:
        return take_part(in);
      case CrewWord::learn:
        return member_->learn(in.get<std::vector<Bytes>>());
      case CrewWord::pass:
        pass_ = in.get<std::uint64_t>();
        if (!is_halted()) member_->begin(std::make_shared<const BlockPass>(in.get<BlockPass>()), progress());
        return;
      case CrewWord::work:
        if (!is_halted()) compute(in);
        return;
      default:
        return;
    }
  }

  // What fails here fails again when it counts.
  void wake_up(ByteReader& in) {
    try {
      open_device(in);
    } catch (const Error&) {
      device_.reset();
    }
  }
  void warm(ByteReader& in) {
    if (!device_) return;
    std::string name;
    opencl::Defines defines;
    in(name, defines);
    try {
      opencl::program(device_->state(), name, defines);
    } catch (const BuildError&) {
      return;
    }
  }

  void open(ByteReader& in) {
    failed_ = nullptr;
    open_device(in);
    say(CrewWord::hello, 0);
  }

  void open_device(ByteReader& in) {
    const std::string device = device_of(in.get<std::string>(), messenger_.place());
    auto memory = in.get<std::uint64_t>();
    in(scratch_folder_);
    if (memory == 0) memory = half_of_free_memory();
    memory /= static_cast<std::uint64_t>(messenger_.neighbours());
    if (!device_ || device != opened_) {
      member_.reset();
      device_.reset();
      device_.emplace(device, memory);
      opened_ = device;
    }
  }

  void say(CrewWord word, double arithmetic) {
    messenger_.send(leader,
                    message_of(word, Crew::Kind{device_->info(), probe_filters(*device_), arithmetic}));
  }

  void take_scan(ByteReader& in) {
    member_.reset();
    const auto lent = in.get<std::uint64_t>(), samples = in.get<std::uint64_t>();
    const auto mixed = in.get<bool>();
    const auto common = in.get<std::uint64_t>();
    scan_ = {};
    sups_ = {};
    GoldSettings settings;
    in(scan_, sups_, settings);
    const auto [bytes, owner] = messenger_.lent(lent);
    if (bytes.size() != samples * sizeof(float))
      throw ResourceError("the projections, filtered, did not arrive");
    // Nobody writes to a scan.
    auto* first = const_cast<float*>(reinterpret_cast<const float*>(bytes.data()));
    scan_.samples = SampleArray(std::span(first, samples), owner);
    member_.emplace(device_->state(), scan_, sups_, settings);
    if (common != 0)
      member_->pool_gold([this, common](std::uint64_t size) { return messenger_.common(common, size); });
    const std::uint64_t share = std::max<std::uint64_t>(device_->state().memory.limit() / 8, least_share);
    budget_ = {std::make_shared<Scratch>(scratch_folder_.empty() ? default_scratch_folder()
                                                                 : std::filesystem::path(scratch_folder_),
                                         share),
               share};
    if (mixed) say(CrewWord::ready, member_->arithmetic());
  }

  void take_field(ByteReader& in) {
    field_ = get_shape(in, budget_);
    parts_ = samples_to(field_);
    part_ = 0;
    while (part_ < parts_.size() && parts_[part_].empty()) ++part_;
    if (part_ == parts_.size()) member_->use(field_, budget_);
  }

  void take_part(ByteReader& in) {
    const auto bytes = in.get<Bytes>();
    if (part_ >= parts_.size() || bytes.size() > parts_[part_].size())
      throw ResourceError("samples of a field came out of turn");
    std::memcpy(parts_[part_].data(), bytes.data(), bytes.size());
    parts_[part_] = parts_[part_].subspan(bytes.size());
    while (part_ < parts_.size() && parts_[part_].empty()) ++part_;
    if (part_ < parts_.size()) return;
    member_->use(field_, budget_);
    parts_.clear();
    part_ = 0;
    field_ = {};  // it lies on the device
  }

  void compute(ByteReader& in) {
    const auto number = in.get<std::uint64_t>(), piece = in.get<std::uint64_t>();
    const auto works = in.get<Works>();
    if (number != pass_) return;
    member_->compute(
        works,
        [&](const Bytes& record) {
          messenger_.send(leader, message_of(CrewWord::record, number, piece, record));
          said_ = Clock::now();
        },
        progress());
    messenger_.send(leader, message_of(CrewWord::done, number, piece));
  }

  Progress progress() {
    return [this](const std::string&, double) {
      throw_if_stopped();
      if (Clock::now() - said_ < alive_every) return;
      said_ = Clock::now();
      messenger_.send(leader, message_of(CrewWord::alive));
    };
  }

  static constexpr std::uint64_t least_share = std::uint64_t{64} << 20;

  Messenger& messenger_;
  std::deque<Bytes> queue_;
  std::exception_ptr failed_;
  std::string opened_, scratch_folder_;
  std::optional<Device> device_;
  FilteredScan scan_;
  FieldSups sups_;
  std::optional<CrewMember> member_;
  MemoryBudget budget_;
  MixedVolume field_;
  std::vector<std::span<std::byte>> parts_;
  std::size_t part_ = 0;
  std::uint64_t pass_ = 0;
  Clock::time_point said_ = Clock::now();
};

}  // namespace

void join_crew(Messenger& messenger) { CrewProcess(messenger).run(); }

void wake(Device& device, const CrewOptions& options) {
  Messenger* messenger = options.messenger;
  if (!messenger || messenger->others() == 0) return;
  const auto send = [messenger](const Bytes& message) {
    for (int process = 1; process <= messenger->others(); ++process) messenger->send(process, message);
  };
  send(message_to_open(CrewWord::wake, options));
  const auto thread = std::this_thread::get_id();
  device.state().on_program = [send, thread](const std::string& name, const opencl::Defines& defines) {
    if (std::this_thread::get_id() != thread) return;  // a messenger has one
    send(message_of(CrewWord::warm, name, defines));
  };
}

void dismiss(Messenger& messenger) {
  for (int process = 1; process <= messenger.others(); ++process)
    messenger.send(process, message_of(CrewWord::dismiss));
}

}  // namespace vdvr
