// Who computes the blocks of a build's passes: one device, several of this process, those of other processes.
// Blocks are independent, and a block has the same record whoever computes it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "host/certify/crew/block_pass.hpp"
#include "host/certify/gold/prepared_scan.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/crew.hpp"
#include "vdvr/expert/probe_sampler.hpp"

namespace vdvr {

using Works = std::vector<GoldStream::Work>;
using OnRecord = std::function<void(const Bytes&)>;
using SharedPass = std::shared_ptr<const BlockPass>;
using Records = std::shared_ptr<const std::vector<Bytes>>;

/// What a worker says of the pass with that number (of all passes of a crew).
struct CrewReport {
  enum class Kind : std::uint8_t { alive, record, done, failed };
  std::size_t worker = 0;
  Kind kind = Kind::alive;
  std::uint64_t pass = 0;
  std::size_t piece = 0;
  Bytes record{};
  std::exception_ptr error{};
};

/// From threads to the one that leads.
class CrewInbox {
 public:
  void put(CrewReport report);
  std::optional<CrewReport> take(std::chrono::milliseconds wait);

 private:
  std::mutex lock_;
  std::condition_variable arrived_;
  std::deque<CrewReport> reports_;
};

/// Does what it is told in the order in which it is told, and does not let the caller wait for it.
class CrewWorker {
 public:
  CrewWorker() = default;
  CrewWorker(const CrewWorker&) = delete;
  CrewWorker& operator=(const CrewWorker&) = delete;
  virtual ~CrewWorker() = default;
  /// The field that passes measure from here on. `volume` stays until halt() or the next pass has ended.
  virtual void use(const MixedVolume& volume, const MemoryBudget& budget) = 0;
  /// Records of `remainder`.
  virtual void learn(const Records& records) = 0;
  virtual void begin(std::uint64_t number, SharedPass pass) = 0;
  virtual void give(std::uint64_t number, std::size_t piece, const Works& works) = 0;
  /// Forgets what was given and waits until nothing of the caller's is read any more.
  virtual void halt() = 0;
  /// In another process, which may die or hang without this one.
  [[nodiscard]] virtual bool is_remote() const = 0;
};

class Crew {
 public:
  /// The leader's device takes part; `from`, and what options name, are referred to. `all`: nearly all gold
  /// will be asked for, so that it is worth keeping once for all of a machine. Throws InputError where
  /// devices differ that must not.
  Crew(Device& leader, PreparedScan& from, const GoldSettings& settings, const CrewOptions& options,
       bool all);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  void use(const MixedVolume& volume, const MemoryBudget& budget);
  void run(GoldStream& gold, const SharedPass& pass, const DeviceField* field, Works works,
           const OnRecord& on_record, const Progress& progress, const std::string& stage);

  /// Finds what T leaves out of these bricks, as far as nobody knows it, and tells all.
  void look_at(GoldStream& gold, const std::vector<std::uint8_t>& selected, const Progress& progress);

  /// Name and driver of every kind of device, the leader's first.
  struct Kind {
    DeviceInfo info;
    SamplerProbe probe;
    double arithmetic = 0;
  };
  [[nodiscard]] const std::vector<Kind>& kinds() const { return kinds_; }
  /// Sent to other processes and received from them, and what that took here.
  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] double message_seconds() const;

 private:
  class Leader;
  struct State;
  void wait_for_kinds();
  std::uint64_t pool_gold(PreparedScan& from, const GoldSettings& settings, std::uint64_t number);
  std::unique_ptr<State> state_;
  std::vector<Kind> kinds_;
};

/// By the crew, or without one by the stream itself, block after block.
void run_blocks(Crew* crew, GoldStream& gold, const SharedPass& pass, const DeviceField* field, Works works,
                const OnRecord& on_record, const Progress& progress, const std::string& stage);

}  // namespace vdvr
