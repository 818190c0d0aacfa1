// What a certificate says besides |V - F| <= epsilon, computed again (docs/error-bounds.md, "What verify
// compares"). Three parts: what follows from scan and file alone, what build computes (made again by build's
// own code: this finds edits, the measure of |V - F| is another), and points where |V - F| is evaluated.
// Called by verify.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/verify_field.hpp"
#include "vdvr/certificate.hpp"
#include "vdvr/device.hpp"
#include "vdvr/exact_field.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/projections.hpp"

namespace vdvr {

/// One line for each claim that differs from what it should be.
using Differences = std::vector<std::string>;

/// Input, geometry, options, rates, coverage, region and the relations between totals: all that needs no
/// field. `used` is the scan's geometry with the centre in use.
Differences compare_scope(const ProjectionSet& scan, const ParallelGeometry& used, const MixedVolume& volume,
                          const Certificate& stored);

/// The sampler terms of the stored samples on this device.
Differences compare_samplers(const SamplerTerms& found, const SamplerTerms& least, bool same_device,
                             const Certificate& stored);

/// Reference range, arithmetic, P, and T + P with |V - gold| in the selected bricks. Cost: what `build` takes
/// to filter, to reconstruct the base, and to measure those bricks. `exhaustive`: all bricks are selected.
Differences compare_terms(Device& device, const ProjectionSet& scan, const ExactField& exact,
                          const MixedVolume& volume, const Certificate& stored,
                          const std::vector<std::uint8_t>& selected, bool exhaustive,
                          const Progress& progress);

/// Looks for points where |V - F| is above what the certificate bounds it by in their brick, in the cells
/// whose bound by verify is farthest above: verify's bound may just be the looser one.
class TotalAttack {
 public:
  TotalAttack(const MixedVolume& volume, const Certificate& stored);

  /// Keeps the brick's worst cells, if they are among the worst of all.
  void consider(const VerifyField::Piece& piece);

  struct Outcome {
    std::int64_t points = 0;  ///< evaluated
    double worst_share = 0;   ///< largest |V - F| there, as a share of what is certified
    std::string failure;      ///< empty: no point is above
  };
  /// |V - F| at the middles of the kept cells, of their faces and edges, in double precision. Cost: at most
  /// 4,000 points, and few enough heights that they take about 2e10 multiply-adds.
  [[nodiscard]] Outcome run(const ExactField& exact, const Progress& progress) const;

 private:
  struct Cell {
    double excess = 0;  ///< verify's bound, as a share of the certificate's
    std::int64_t brick = 0;
    Index3 cell{0, 0, 0};
  };
  [[nodiscard]] double certified(std::int64_t brick) const;

  const MixedVolume& volume_;
  const Certificate& stored_;
  double rest_ = 0;  // arithmetic and sampler
  std::vector<Cell> cells_;
};

}  // namespace vdvr
