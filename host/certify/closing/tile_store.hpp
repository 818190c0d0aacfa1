// The bricks' own samples before closing: one array after the other, in memory or, where they take more than
// the room there, in scratch.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "host/base/system/scratch_pass.hpp"
#include "vdvr/expert/sample_array.hpp"

namespace vdvr {

/// Tiles by brick; empty at first. One thread may write, or many read.
class TileStore {
 public:
  TileStore() = default;
  explicit TileStore(MemoryBudget budget) : budget_(std::move(budget)) {}

  void resize(std::size_t bricks) { places_.resize(bricks); }
  [[nodiscard]] std::size_t size() const { return places_.size(); }
  [[nodiscard]] std::span<const float> operator[](std::size_t brick) const {
    const Place& p = places_[brick];
    if (p.size == 0) return {};
    return std::span<const float>(parts_[p.part]).subspan(p.first, p.size);
  }
  [[nodiscard]] std::span<float> operator[](std::size_t brick) {
    const Place& p = places_[brick];
    if (p.size == 0) return {};
    return std::span<float>(parts_[p.part]).subspan(p.first, p.size);
  }
  [[nodiscard]] std::vector<float> copy(std::size_t brick) const {
    const std::span<const float> tile = (*this)[brick];
    return {tile.begin(), tile.end()};
  }
  /// The place of a tile that shrank or grew is lost until clear(). Throws ResourceError.
  void put(std::size_t brick, std::span<const float> tile) {
    Place& p = places_.at(brick);
    if (p.size != tile.size()) p = place_for(tile.size());
    std::copy(tile.begin(), tile.end(), (*this)[brick].begin());
  }
  /// No tile of that brick.
  void drop(std::size_t brick) { places_.at(brick) = {}; }
  /// No tiles.
  void clear() {
    std::fill(places_.begin(), places_.end(), Place{});
    parts_.clear();
    bytes_ = memory_bytes_ = used_ = 0;
  }
  void add_to(ScratchPass& pass) const {
    for (const Samples<float>& part : parts_) pass.add(part);
  }
  /// Of what lies in memory.
  [[nodiscard]] std::uint64_t memory_bytes() const { return memory_bytes_; }

  friend bool operator==(const TileStore& a, const TileStore& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!std::ranges::equal(a[i], b[i])) return false;
    return true;
  }

 private:
  struct Place {
    std::uint32_t part = 0, first = 0, size = 0;
  };
  // Samples of a part: as many as there are already, between these.
  static constexpr std::size_t smallest = std::size_t{1} << 16, largest = std::size_t{1} << 24;

  Place place_for(std::size_t n) {
    if (n == 0) return {};
    if (parts_.empty() || parts_.back().size() - used_ < n) {
      const std::size_t size = std::max(n, std::clamp(bytes_ / sizeof(float), smallest, largest));
      const std::uint64_t more = sizeof(float) * size;
      parts_.emplace_back(size, budget_.for_bytes(bytes_ + more), "the tiles before closing");
      bytes_ += more;
      if (!parts_.back().scratch()) memory_bytes_ += more;
      used_ = 0;
    }
    return {static_cast<std::uint32_t>(parts_.size() - 1),
            static_cast<std::uint32_t>(std::exchange(used_, used_ + n)), static_cast<std::uint32_t>(n)};
  }

  MemoryBudget budget_;
  std::vector<Samples<float>> parts_;
  std::vector<Place> places_;
  std::size_t used_ = 0;  // of the last part
  std::uint64_t bytes_ = 0, memory_bytes_ = 0;
};

}  // namespace vdvr
