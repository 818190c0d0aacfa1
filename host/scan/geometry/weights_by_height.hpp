// Weights of views by height, where views saw the sample at other heights: a series of heights, a helix of
// parallel beam (docs/geometry.md, "Series of heights").
//
// A view of V rows counts at its row y by
//
//   tau(y) = s((min(y, V - 1 - y) + 1/2) / (T + 1/2)),   T = min(10, (V - 1) / 4),
//
// s(r) = r^3 (10 - 15 r + 6 r^2) up to r = 1 and 1 beyond, tau = 0 where the view has no row. For a share x
// let S_x be the views with tau >= x at a height, and w_k(S_x) half the gaps to both neighbouring directions
// among these (views of one direction share alike): a rule for sums over directions. So is their mean
//
//   W_k = 1 / x' integral from 0 to x' of w_k(S_x) dx,
//
// in which a view comes and goes with tau. x' is the largest share up to which no gap of S_x is wider than
// four times the widest one of S_0, and than four times that of half the heights; where S_0 itself has a
// wider one, or a wedge, the height is not covered. F's weight of view k is W_k at each height: rows are
// multiplied by W_k / w, with w the weight that the view has among all (view_weights.hpp).
//
// Views of one direction (modulo 2 pi), and one shift along columns, become one: their sum is taken first.
#pragma once

#include <cstdint>
#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Views within it are of one direction. It moves what lies 1,000 columns from the axis by .002 columns.
inline constexpr double same_direction_rad = 2e-6;

class WeightsByHeight {
 public:
  /// Of `series`: angles, shifts, rows and full_turn. Throws InputError for shifts beyond the rows of all
  /// views together, which leave heights that none sees. Cost: heights * views * log(views); memory: 8 bytes
  /// a measured row of a view.
  explicit WeightsByHeight(const HeightSeries& series);

  /// Angles of the views that the series becomes, and the measured ones that each is a sum of.
  [[nodiscard]] const std::vector<double>& theta_rad() const { return theta_rad_; }
  [[nodiscard]] const std::vector<std::int64_t>& measured(std::int64_t view) const;
  /// Of a measured view: its row at a height, which may be none.
  [[nodiscard]] double place(std::int64_t view, std::int64_t height) const;
  /// W / w of a measured view; 0 where it has no row.
  [[nodiscard]] double share(std::int64_t view, std::int64_t height) const;
  /// Their sum over the measured views of one that the series becomes.
  [[nodiscard]] double shares(std::int64_t view, std::int64_t height) const;

  struct Run {
    std::int64_t first = 0, count = 0;
  };
  /// Of neighbouring heights that are seen from every direction, in ascending order.
  [[nodiscard]] const std::vector<Run>& covered() const { return covered_; }
  /// Heights that any view sees.
  [[nodiscard]] Run seen() const { return {first_, heights_}; }

 private:
  struct Window {
    std::int64_t first, last;  ///< heights
  };
  struct Height;
  void join_views();
  [[nodiscard]] Height look(std::int64_t height) const;
  void set_shares(std::int64_t height, const std::vector<double>& w);

  HeightSeries series_;
  double period_ = 0, usual_rad_ = 0;  ///< of heights' widest gaps the middle one
  std::int64_t first_ = 0, heights_ = 0;
  std::vector<Window> window_;           ///< by measured view
  std::vector<std::size_t> direction_;   ///< modulo the period, by measured view
  std::vector<double> direction_place_;  ///< ascending
  std::vector<std::int64_t> view_of_;    ///< what a measured view is part of
  std::vector<std::vector<std::int64_t>> measured_;
  std::vector<double> theta_rad_, share_;  ///< share_: [measured view][row of its window]
  std::vector<Run> covered_;
};

}  // namespace vdvr
