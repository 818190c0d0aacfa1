// A brick's cells that are in a range surely or possibly, and the parts that they form within it.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "host/measure/measure_volume.hpp"

namespace vdvr::measured {

/// Of possible parts: what is added up when two turn out to be one.
struct PossibleRecord {
  Interval volume{0, 0};
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  std::uint8_t touches = 0;     ///< bit 2 a: the region's lower side along axis a, bit 2 a + 1 its upper one
  std::uint8_t sure_spans = 0;  ///< bit a: a sure part reaches from one to the other
  std::int64_t sure_parts = 0;

  PossibleRecord& operator+=(const PossibleRecord& o);
};
struct SureRecord {
  std::uint8_t touches = 0;
  std::uint32_t possible = 0;  ///< the possible part that holds it

  SureRecord& operator+=(const SureRecord& o) {
    touches |= o.touches;
    return *this;
  }
};

inline constexpr std::uint32_t no_part = std::numeric_limits<std::uint32_t>::max();

/// Labels of cells: of each its own, or one for all.
struct Labels {
  std::vector<std::uint32_t> of_cell;  ///< [z][y][x], empty where all have one
  std::uint32_t of_all = no_part;

  [[nodiscard]] bool uniform() const { return of_cell.empty(); }
  [[nodiscard]] bool none() const { return uniform() && of_all == no_part; }
  [[nodiscard]] std::uint32_t operator()(std::size_t cell) const {
    return uniform() ? of_all : of_cell[cell];
  }
};

struct LabelledBrick {
  Index3 brick{}, count{};
  std::array<int, 3> per_cell{};  ///< log2 of its cells per cell of the grid
  bool whole = false;             ///< lies in the region altogether
  Labels possible, sure;
  /// Of each label: at first its part of this brick, then its number among all.
  std::vector<std::uint32_t> possible_ids, sure_ids;
  std::vector<PossibleRecord> possible_parts;
  std::vector<SureRecord> sure_parts;

  [[nodiscard]] std::size_t cell(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return static_cast<std::size_t>((z * count[1] + y) * count[0] + x);
  }
  [[nodiscard]] std::uint64_t bytes() const;
};

/// Labels of a brick that may meet the region. Within it possible cells join through faces, edges and
/// corners; sure ones through faces that hold a point of the region.
LabelledBrick label_brick(const Field& field, const BrickCells& cells, const ValueRange& range);

/// Joins numbers. The smaller number of two roots stays.
class UnionFind {
 public:
  std::uint32_t add() {
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    return parent_.back();
  }
  [[nodiscard]] std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a < b) parent_[b] = a;
    else parent_[a] = b;
  }
  [[nodiscard]] std::size_t size() const { return parent_.size(); }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace vdvr::measured
