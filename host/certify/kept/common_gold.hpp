// Kept gold that devices of one machine make together and all read: threads of a process, or processes that
// share memory. Whoever dies or hangs is not waited for: what he took, others make again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "vdvr/expert/common_memory.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

class CommonGold {
 public:
  /// What all must agree on.
  struct Shape {
    std::vector<std::pair<std::int64_t, std::int64_t>> tiles;  ///< y, x
    std::uint64_t tile = 0, heights = 0;  ///< floats of a tile: of its rows, and of heights made of them
    std::int64_t rows = 0;                ///< of the detector
    std::vector<std::int64_t> more;       ///< whatever else decides what is kept
  };
  static std::uint64_t bytes_of(const Shape& shape);

  /// `given`: by tile, what the first one here has already and will put into rows(); others find it out.
  /// Throws std::logic_error where the memory is too small.
  CommonGold(CommonMemory memory, Shape shape, const std::vector<std::uint8_t>& given);

  /// Whether those who were here before keep the same gold.
  [[nodiscard]] bool agrees() const { return agrees_; }
  [[nodiscard]] const Shape& shape() const { return shape_; }
  [[nodiscard]] std::uint64_t own_bytes() const;
  /// Tiles in the order in which they lie: those that were given, then the others.
  [[nodiscard]] const std::vector<std::size_t>& order() const { return order_; }
  [[nodiscard]] std::size_t given() const { return given_; }
  /// Of so many tiles from one on, in that order.
  [[nodiscard]] std::span<float> rows(std::size_t first, std::size_t tiles) const;
  [[nodiscard]] std::span<float> heights(std::size_t first, std::size_t tiles) const;
  [[nodiscard]] const std::shared_ptr<void>& owner() const { return memory_.owner; }

  /// Rows are made in chunks of so many, of all tiles that were not given.
  static constexpr std::int64_t chunk = 16;
  /// Calls make(chunk) or make(tile of order()) for those that nobody has made or is making, and returns when
  /// all are made. make() returns when the memory holds what it made: the same whoever makes it.
  void make_rows(const std::function<void(std::size_t)>& make, const Progress& progress);
  void make_heights(const std::function<void(std::size_t)>& make, const Progress& progress);

 private:
  using State = std::uint32_t;
  [[nodiscard]] std::span<State> states(std::size_t first, std::size_t n) const;
  void make(std::span<State> states, const std::function<void(std::size_t)>& make, const Progress& progress);
  [[nodiscard]] std::size_t chunks() const;

  CommonMemory memory_;
  Shape shape_;
  bool agrees_ = true;
  std::vector<std::size_t> order_;
  std::size_t given_ = 0;
};

}  // namespace vdvr
