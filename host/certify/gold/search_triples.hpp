// Which level triples of a brick to try, cheapest first, so that few are tried.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "host/certify/gold/gold_settings.hpp"

namespace vdvr {

/// How far linear interpolation along each axis alone errs in a brick: by axis x, y, z and level, the largest
/// of interpolant - gold and of gold - interpolant. At the gold rate nothing.
struct AxisErrors {
  static constexpr int most_levels = 6;
  std::array<std::array<std::array<float, 2>, most_levels>, 3> of{};
};

/// The candidates of a volume, from the cheapest to the last before gold itself.
class TripleSearch {
 public:
  /// Levels up to the gold rate's. Isotropic: the levels in turn. `proposing`: only levels whose samples lie
  /// two nodes of gold apart or more along every axis; of others gold does not show what they err.
  explicit TripleSearch(const GoldSettings& settings, bool proposing = false);

  /// One brick's search. Cost of next(): a look at each candidate.
  struct Brick {
    AxisErrors errors;
    float slack = 0;  ///< what even gold may err
    float scale = 1;  ///< of the foreseen error, from what was tried
    std::vector<LevelTriple> failed{};
  };
  /// The cheapest triple that is foreseen to pass; none: only gold is left.
  [[nodiscard]] std::optional<LevelTriple> next(const Brick& brick, float tolerance) const;
  /// That triple was tried and took `total`, which is too much.
  void fail(Brick& brick, const LevelTriple& level, float total) const;

 private:
  [[nodiscard]] float forecast(const Brick& brick, const LevelTriple& level) const;

  [[nodiscard]] bool is_isotropic(const LevelTriple& level) const;

  LevelTriple coarsening_, top_;
  bool anisotropic_, fitted_;
  std::vector<LevelTriple> candidates_;
};

}  // namespace vdvr
