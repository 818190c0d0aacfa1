#include "apps/vdvr/serve/drawing.hpp"

#include <algorithm>
#include <utility>

#include "vdvr/error.hpp"

namespace vdvr::cli {

Drawing::Drawing(LiveRenderer& renderer) : renderer_(renderer), thread_([this] { work(); }) {}

Drawing::~Drawing() {
  end();
  thread_.join();
}

std::future<Drawing::Answer> Drawing::ask(const std::string& client, const LiveState& state, bool moving) {
  Job job{client, state, moving, {}};
  auto future = job.answer.get_future();
  const std::scoped_lock lock(mutex_);
  const auto old = std::find_if(waiting_.begin(), waiting_.end(),
                                [&](const Job& waiting) { return waiting.client == client; });
  if (ending_) {
    job.answer.set_value({Outcome::ending, {}, {}});
  } else if (old != waiting_.end()) {
    old->answer.set_value({Outcome::replaced, {}, {}});
    *old = std::move(job);
  } else if (waiting_.size() >= kMostWaiting) {
    job.answer.set_value({Outcome::busy, {}, {}});
  } else {
    waiting_.push_back(std::move(job));
    changed_.notify_one();
  }
  return future;
}

void Drawing::end() {
  const std::scoped_lock lock(mutex_);
  ending_ = true;
  for (Job& job : waiting_) job.answer.set_value({Outcome::ending, {}, {}});
  waiting_.clear();
  changed_.notify_one();
}

void Drawing::work() {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ending_ || !waiting_.empty(); });
    if (ending_) return;
    Job job = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    job.answer.set_value(drawn(job));
  }
}

Drawing::Answer Drawing::drawn(const Job& job) {
  try {
    return {
        Outcome::drawn, renderer_.draw(job.state.view, job.state.width, job.state.height, job.moving), {}};
  } catch (const Interrupted&) {
    return {Outcome::ending, {}, {}};
  } catch (const std::exception& e) {
    return {Outcome::failed, {}, e.what()};
  }
}

}  // namespace vdvr::cli
