// Workers of a crew: a device of this process with a thread of its own, and another process.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "host/certify/crew/crew.hpp"
#include "host/certify/crew/crew_member.hpp"

namespace vdvr {

/// Messages of the leader, and its seconds for them.
struct CrewTraffic {
  std::uint64_t bytes = 0;
  double seconds = 0;
};

/// What a thread computes with.
class CrewDevice {
 public:
  CrewDevice() = default;
  CrewDevice(const CrewDevice&) = delete;
  CrewDevice& operator=(const CrewDevice&) = delete;
  virtual ~CrewDevice() = default;
  virtual void use(const MixedVolume& volume, const MemoryBudget& budget) = 0;
  virtual void begin(const SharedPass& pass, const Progress& progress) = 0;
  virtual void learn(const std::vector<Bytes>& records) = 0;
  virtual void compute(const Works& works, const std::function<void(Bytes)>& on_record,
                       const Progress& progress) = 0;
};

/// Of another device than the leader's.
class OtherDevice final : public CrewDevice {
 public:
  OtherDevice(opencl::State& state, const PreparedScan& from, const GoldSettings& settings)
      : member_(state, from.filtered, from.sups, settings) {}
  void use(const MixedVolume& volume, const MemoryBudget& budget) override { member_.use(volume, budget); }
  void begin(const SharedPass& pass, const Progress& progress) override { member_.begin(pass, progress); }
  void compute(const Works& works, const std::function<void(Bytes)>& on_record,
               const Progress& progress) override {
    member_.compute(works, on_record, progress);
  }
  void learn(const std::vector<Bytes>& records) override { member_.learn(records); }
  void pool_gold(CrewMember::RoomForGold room) { member_.pool_gold(std::move(room)); }
  [[nodiscard]] double arithmetic() { return member_.arithmetic(); }

 private:
  CrewMember member_;
};

/// The leader's own streams, with the gold that its plan kept, and the field as it has it.
class LeadersDevice final : public CrewDevice {
 public:
  explicit LeadersDevice(opencl::State& state) : state_(state) {}
  /// Of the passes that follow; while nothing is computed.
  void set(GoldStream& gold, const DeviceField* field) {
    gold_ = &gold;
    field_ = field;
  }
  void use(const MixedVolume&, const MemoryBudget&) override {}
  void learn(const std::vector<Bytes>&) override {}
  void begin(const SharedPass& pass, const Progress& progress) override;
  void compute(const Works& works, const std::function<void(Bytes)>& on_record,
               const Progress& progress) override;

 private:
  opencl::State& state_;
  GoldStream* gold_ = nullptr;
  const DeviceField* field_ = nullptr;
  SharedPass pass_;
  std::optional<opencl::DeviceArray<std::uint8_t>> selected_;
};

class ThreadWorker final : public CrewWorker {
 public:
  /// `inbox` and `device` are referred to.
  ThreadWorker(CrewInbox& inbox, std::size_t index, CrewDevice& device);
  ~ThreadWorker() override;
  void use(const MixedVolume& volume, const MemoryBudget& budget) override;
  void learn(const Records& records) override;
  void begin(std::uint64_t number, SharedPass pass) override;
  void give(std::uint64_t number, std::size_t piece, const Works& works) override;
  /// Fields are still taken, and so is what there is to learn.
  void halt() override;
  [[nodiscard]] bool is_remote() const override { return false; }

 private:
  struct Job {
    bool is_kept = false;  // what passes to come need, whoever is halted
    std::function<void()> run;
  };
  void enqueue(Job job);
  void work();

  CrewInbox& inbox_;
  std::size_t index_;
  CrewDevice& device_;
  std::mutex lock_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool busy_ = false, ends_ = false;
  std::atomic<bool> halted_ = false;
  std::thread thread_;
};

class RemoteWorker final : public CrewWorker {
 public:
  RemoteWorker(Messenger& messenger, int process, CrewTraffic& traffic)
      : messenger_(messenger), process_(process), traffic_(traffic) {}
  void use(const MixedVolume& volume, const MemoryBudget& budget) override;
  void learn(const Records& records) override;
  void begin(std::uint64_t number, SharedPass pass) override;
  void give(std::uint64_t number, std::size_t piece, const Works& works) override;
  void halt() override;
  void send(Bytes message);
  [[nodiscard]] bool is_remote() const override { return true; }

 private:
  Messenger& messenger_;
  int process_;
  CrewTraffic& traffic_;
};

}  // namespace vdvr
