// Points inside cells where |V - F| is evaluated, because verify's bound there is above the certificate's
// (docs/error-bounds.md, "What verify compares").
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/verify/verify_field.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// Looks for points where |V - F| is above what the certificate bounds it by in their brick, in the cells
/// whose bound by verify is farthest above: verify's bound may just be the looser one.
class TotalAttack {
 public:
  /// Refers to all it is given.
  TotalAttack(const MixedVolume& volume, const Certificate& stored, const CertifiedRegion& region);

  /// Keeps the brick's worst cells, if they are among the worst of all.
  void consider(const VerifyField::Piece& piece);

  struct Outcome {
    std::int64_t points = 0;  ///< evaluated
    double worst_share = 0;   ///< largest |V - F| there, as a share of what is certified
    std::string failure;      ///< empty: no point is above
  };
  /// |V - F| at the middles of the kept cells, of their faces and edges, in double precision. Cost: at most
  /// 4,000 points, and few enough heights (of cone beam, points) that they take about 2e10 multiply-adds.
  [[nodiscard]] Outcome run(const ExactField& exact, const Progress& progress) const;

 private:
  struct Cell {
    double excess = 0;  ///< verify's bound less what it charges all cells, as a share of the certificate's
    std::int64_t brick = 0;
    int rate = 1;
    Index3 cell{0, 0, 0};
  };
  [[nodiscard]] double certified(std::int64_t brick) const;

  const MixedVolume& volume_;
  const Certificate& stored_;
  const CertifiedRegion& region_;
  double rest_ = 0;  // arithmetic and sampler
  std::vector<Cell> cells_;
};

}  // namespace vdvr
