#include "host/certify/crew/crew_worker.hpp"

#include <algorithm>
#include <utility>

#include "host/certify/crew/crew_messages.hpp"

namespace vdvr {

void LeadersDevice::begin(const SharedPass& pass, const Progress& progress) {
  selected_.reset();
  pass_ = pass;
  selected_.emplace(state_, std::span<const std::uint8_t>(pass_->selected), "bricks of a pass");
  gold_->prepare(pass_->selected, pass_->purpose, progress);
}

void LeadersDevice::compute(const Works& works, const std::function<void(Bytes)>& on_record,
                            const Progress& progress) {
  compute_blocks(*gold_, *pass_, field_, *selected_, works, on_record, progress, "blocks");
}

// --- a thread ---

namespace {

// Ends a piece that nobody waits for.
struct Halted {};

}  // namespace

ThreadWorker::ThreadWorker(CrewInbox& inbox, std::size_t index, CrewDevice& device)
    : inbox_(inbox), index_(index), device_(device), thread_([this] { work(); }) {}

ThreadWorker::~ThreadWorker() {
  halt();
  {
    const std::lock_guard guard(lock_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ThreadWorker::enqueue(Job job) {
  {
    const std::lock_guard guard(lock_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_all();
}

void ThreadWorker::work() {
  std::unique_lock guard(lock_);
  for (;;) {
    changed_.wait(guard, [&] { return ends_ || !jobs_.empty(); });
    if (ends_) return;
    const auto job = std::move(jobs_.front());
    jobs_.pop_front();
    busy_ = true;
    guard.unlock();
    try {
      job.run();
    } catch (const Halted&) {
    } catch (...) {
      inbox_.put({index_, CrewReport::Kind::failed, 0, 0, {}, std::current_exception()});
    }
    guard.lock();
    busy_ = false;
    changed_.notify_all();
  }
}

void ThreadWorker::use(const MixedVolume& volume, const MemoryBudget& budget) {
  enqueue({true, [this, &volume, budget] { device_.use(volume, budget); }});
}

void ThreadWorker::learn(const Records& records) {
  enqueue({true, [this, records] { device_.learn(*records); }});
}

void ThreadWorker::begin(std::uint64_t, SharedPass pass) {
  enqueue({false, [this, pass = std::move(pass)] {
             device_.begin(pass, [this](const std::string&, double) {
               if (halted_) throw Halted();
             });
           }});
}

void ThreadWorker::give(std::uint64_t number, std::size_t piece, const Works& works) {
  const auto check = [this] {
    if (halted_) throw Halted();
  };
  const auto record = [this, check, number, piece](Bytes bytes) {
    check();
    inbox_.put({index_, CrewReport::Kind::record, number, piece, std::move(bytes), {}});
  };
  enqueue({false, [this, number, piece, works, check, record] {
             device_.compute(works, record, [&](const std::string&, double) { check(); });
             inbox_.put({index_, CrewReport::Kind::done, number, piece, {}, {}});
           }});
}

void ThreadWorker::halt() {
  halted_ = true;
  {
    std::unique_lock guard(lock_);
    std::erase_if(jobs_, [](const Job& job) { return !job.is_kept; });
    changed_.wait(guard, [&] { return !busy_ && jobs_.empty(); });
  }
  halted_ = false;
}

// --- another process ---

void RemoteWorker::send(Bytes message) {
  const auto start = std::chrono::steady_clock::now();
  traffic_.bytes += message.size();
  messenger_.send(process_, std::move(message));
  traffic_.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void RemoteWorker::use(const MixedVolume& volume, const MemoryBudget&) {
  ByteWriter shape;
  shape.put(CrewWord::field);
  put_shape(shape, volume);
  send(shape.take());
  for (const auto& samples : samples_of(volume))
    for (std::uint64_t from = 0; from < samples.size(); from += part_bytes) {
      const auto part = samples.subspan(from, std::min<std::uint64_t>(part_bytes, samples.size() - from));
      send(message_of(CrewWord::part, Bytes(part.begin(), part.end())));
    }
}

void RemoteWorker::learn(const Records& records) { send(message_of(CrewWord::learn, *records)); }

void RemoteWorker::begin(std::uint64_t number, SharedPass pass) {
  send(message_of(CrewWord::pass, number, *pass));
}

void RemoteWorker::give(std::uint64_t number, std::size_t piece, const Works& works) {
  send(message_of(CrewWord::work, number, std::uint64_t{piece}, works));
}

void RemoteWorker::halt() { send(message_of(CrewWord::halt)); }

}  // namespace vdvr
