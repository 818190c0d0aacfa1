// Nodes drawn by chance at which verify's F is held to F in double precision: it would tell of a wrong
// weight, halo or mirror that build and verify had in common (docs/error-bounds.md, "What verify does").
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/verify/verify_field.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

class FieldPoints {
 public:
  /// Draws bricks among the selected ones whose middle lies in the region. Few where F is dear: some 1e9
  /// multiply-adds in all, but for at least four bricks and 64 nodes of each (16 of cone beam) at each rate.
  FieldPoints(const ExactField& exact, const CertifiedRegion& region, const MixedVolume& volume,
              const std::vector<std::uint8_t>& selected, unsigned seed);

  [[nodiscard]] const std::vector<std::size_t>& bricks() const { return bricks_; }
  /// 1 for each of these bricks, 2 for those of them that are looked at on interpolated gold too.
  [[nodiscard]] const std::vector<std::uint8_t>& flags() const { return flags_; }
  [[nodiscard]] std::int64_t nodes_each() const { return nodes_each_; }

  struct Outcome {
    std::int64_t points = 0;
    double worst_share = 0;  ///< largest difference, as a share of what verify bounds it by
    std::string failure;     ///< empty: none is above
  };
  static Outcome compare(const ExactField& exact, std::span<const VerifyField::Node> nodes,
                         const Progress& progress);

 private:
  std::vector<std::size_t> bricks_;
  std::vector<std::uint8_t> flags_;
  std::int64_t nodes_each_ = 0;
};

}  // namespace vdvr
