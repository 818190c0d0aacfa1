// Who makes what of common gold, by marks in the memory itself: free, taken, made.
#include "host/certify/kept/common_gold.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

using Clock = std::chrono::steady_clock;

enum Mark : std::uint32_t { is_free = 0, is_taken = 1, is_made = 2 };

// Before the marks: what all must agree on, then the marks of tiles, chunks and heights.
constexpr std::size_t first_mark = 16;
constexpr std::uint64_t page = 4096;
// Between looks at what others make.
constexpr std::chrono::microseconds pause{200};
// What was taken and is not made after so long, or after so many times the longest that was seen, is made
// again.
constexpr std::chrono::milliseconds patience{1000};
constexpr int patience_times = 4;

std::uint64_t to_pages(std::uint64_t bytes) { return (bytes + page - 1) / page * page; }

std::uint64_t bytes_of_marks(const CommonGold::Shape& s) {
  const std::uint64_t chunks = count((s.rows + CommonGold::chunk - 1) / CommonGold::chunk);
  return to_pages(sizeof(std::uint32_t) * (first_mark + 2 * s.tiles.size() + chunks));
}

std::uint64_t checksum(const CommonGold::Shape& s) {
  std::uint64_t sum = 0xcbf29ce484222325u;
  const auto add = [&](std::uint64_t word) { sum = (sum ^ word) * 0x100000001b3u; };
  for (const auto& [y, x] : s.tiles) {
    add(static_cast<std::uint64_t>(y));
    add(static_cast<std::uint64_t>(x));
  }
  for (const std::uint64_t n : {s.tile, s.heights, static_cast<std::uint64_t>(s.rows)}) add(n);
  for (const std::int64_t n : s.more) add(static_cast<std::uint64_t>(n));
  return sum | 1;  // never that of memory that nobody has written to
}

}  // namespace

std::uint64_t CommonGold::bytes_of(const Shape& s) {
  return bytes_of_marks(s) + to_pages(4 * s.tile * s.tiles.size()) + to_pages(4 * s.heights * s.tiles.size());
}

CommonGold::CommonGold(CommonMemory memory, Shape shape, const std::vector<std::uint8_t>& given)
    : memory_(std::move(memory)), shape_(std::move(shape)) {
  if (memory_.bytes.size() < bytes_of(shape_)) throw std::logic_error("CommonGold: too little memory");
  const std::size_t tiles = shape_.tiles.size();
  const std::span<State> marks = states(0, tiles);
  std::atomic_ref<std::uint64_t> known(*reinterpret_cast<std::uint64_t*>(memory_.bytes.data()));
  const std::uint64_t own = checksum(shape_);
  if (!given.empty()) {  // before anybody else has the memory
    for (std::size_t i = 0; i < tiles; ++i) marks[i] = given.at(i) ? is_made : is_free;
    known.store(own);
  } else {
    std::uint64_t none = 0;
    agrees_ = known.compare_exchange_strong(none, own) || none == own;
  }
  for (const bool of_given : {true, false})
    for (std::size_t i = 0; i < tiles; ++i)
      if ((marks[i] == is_made) == of_given) order_.push_back(i);
  given_ = static_cast<std::size_t>(std::count(marks.begin(), marks.end(), State{is_made}));
}

std::uint64_t CommonGold::own_bytes() const {
  return bytes_of(shape_) / static_cast<std::uint64_t>(std::max(1, memory_.sharers));
}

std::size_t CommonGold::chunks() const { return at((shape_.rows + chunk - 1) / chunk); }

std::span<CommonGold::State> CommonGold::states(std::size_t first, std::size_t n) const {
  return {reinterpret_cast<State*>(memory_.bytes.data()) + first_mark + first, n};
}

std::span<float> CommonGold::rows(std::size_t first, std::size_t tiles) const {
  auto* all = reinterpret_cast<float*>(memory_.bytes.data() + bytes_of_marks(shape_));
  return {all + first * shape_.tile, tiles * shape_.tile};
}

std::span<float> CommonGold::heights(std::size_t first, std::size_t tiles) const {
  auto* all = reinterpret_cast<float*>(memory_.bytes.data() + bytes_of_marks(shape_) +
                                       to_pages(4 * shape_.tile * shape_.tiles.size()));
  return {all + first * shape_.heights, tiles * shape_.heights};
}

void CommonGold::make_rows(const std::function<void(std::size_t)>& make_one, const Progress& progress) {
  if (given_ < shape_.tiles.size()) make(states(shape_.tiles.size(), chunks()), make_one, progress);
}

void CommonGold::make_heights(const std::function<void(std::size_t)>& make_one, const Progress& progress) {
  make(states(shape_.tiles.size() + chunks(), shape_.tiles.size()), make_one, progress);
}

void CommonGold::make(std::span<State> states, const std::function<void(std::size_t)>& make_one,
                      const Progress& progress) {
  const auto mark = [&](std::size_t i) { return std::atomic_ref<State>(states[i]); };
  Clock::duration longest{};
  const auto make_it = [&](std::size_t i) {
    const auto start = Clock::now();
    try {
      make_one(i);
    } catch (...) {
      State taken = is_taken;
      mark(i).compare_exchange_strong(taken, is_free);
      throw;
    }
    mark(i).store(is_made);
    longest = std::max(longest, Clock::now() - start);
  };
  std::size_t seen = 0;
  auto changed = Clock::now();
  for (;;) {
    std::size_t made = 0, open = states.size(), in_hand = states.size();
    for (std::size_t i = 0; i < states.size(); ++i) {
      const State s = mark(i).load();
      made += s == is_made;
      if (s == is_free) open = std::min(open, i);
      if (s == is_taken) in_hand = std::min(in_hand, i);
    }
    report(progress, "gold", static_cast<double>(made) / static_cast<double>(states.size()));
    if (made == states.size()) return;
    if (made != seen) changed = Clock::now();
    seen = made;
    if (open < states.size()) {
      State none = is_free;
      if (mark(open).compare_exchange_strong(none, is_taken)) make_it(open);
    } else if (Clock::now() - changed > std::max<Clock::duration>(patience, patience_times * longest)) {
      make_it(in_hand);
    } else {
      std::this_thread::sleep_for(pause);
    }
  }
}

}  // namespace vdvr
