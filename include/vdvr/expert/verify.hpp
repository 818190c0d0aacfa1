// The certificate measured again, from the projections and the packed volume alone, by a path of its own: F
// from double-precision cosine coefficients, V by the sampler header, one bound per gold cell
// (docs/error-bounds.md, "What verify does").
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

struct VerifyOptions {
  bool exhaustive = false;  ///< every gold cell; otherwise a stratified sample of bricks and the worst ones
  double fraction = 0.02;   ///< of the bricks, when not exhaustive
  unsigned seed = 1;
  /// Bricks of a sample of cone beam at most, where nodes of F are dear, but for those of rare levels. Where
  /// one brick in 500 is wrong, scattered over the volume, 2,000 hold one with a probability of 98 %.
  std::size_t most_of_cone = 2000;
};

/// A stored sample and how the file names it.
struct SamplePlace {
  Vec3 world{0, 0, 0};
  std::int64_t brick = -1;  ///< (z * bricks_y + y) * bricks_x + x
  Index3 brick_at{0, 0, 0};
  LevelTriple level{0, 0, 0};   ///< z, y, x
  std::string dataset;          ///< "/base" or "/tiles/ZYX"
  std::int64_t tile = 0;        ///< of that dataset; 0 in the base
  Index3 sample{0, 0, 0};       ///< x, y, z inside the tile, or of the base
  double value = 0, field = 0;  ///< V and F at `world`
};

struct VerifyResult {
  bool holds = false;
  double epsilon_abs = 0;
  double measured_max = 0;    ///< largest |V - F| at a tested node
  double measured_total = 0;  ///< largest bound of |V - F| over a tested brick, exact interpolation of V
  double arithmetic = 0;      ///< what verify's own computation of F may err; contained in measured_total
  double total = 0;           ///< measured_total and the worst sampler that is promised of this device
  double total_buffer = 0;
  std::optional<double> total_image3d;              ///< absent where this device has no such sampler
  std::optional<bool> holds_buffer, holds_image3d;  ///< absent where not promised or not on this device
  /// The certificate holds for the texture unit of this device, which built it. That of another is no part of
  /// the promise: `holds` does not ask for holds_image3d, without which pictures here take the buffer.
  bool image3d_promised = false;
  Vec3 worst_at{0, 0, 0};
  SamplePlace worst;  ///< the stored sample nearest to the worst corner of the worst gold cell
  std::int64_t bricks_tested = 0, bricks = 0;
  std::int64_t nodes_tested = 0;  ///< distinct gold nodes, counted once per brick that they belong to
  std::int64_t cells_tested = 0;  ///< gold cells, of the first gold that each brick was tested on
  std::int64_t bricks_finer = 0;  ///< bricks tested again on finer gold, where that decided nothing
  int finest_rate = 0;            ///< of the gold used
  std::int64_t seams = 0;         ///< samples that two bricks store with different bits (exhaustive only)
  /// Points inside cells where |V - F| was evaluated, since verify's bound there is above the certificate's,
  /// and the largest |V - F| found, as a share of what the certificate bounds it by.
  std::int64_t points_evaluated = 0;
  double worst_share = 0;
  /// Nodes drawn by chance at which F was evaluated in double precision beside verify's own, and the largest
  /// difference, as a share of what verify bounds it by.
  std::int64_t field_points = 0;
  double field_share = 0;
  /// What the certificate says and what was computed instead, a line each: range, coverage, geometry, terms,
  /// totals.
  std::vector<std::string> differences;
  std::string failure;  ///< one line: what does not match, and where; empty when it holds
};

/// Recomputes F from `scan` with the field options of `stored` and bounds |V - F| over every tested gold
/// cell, V through the sampler header, on gold a quarter of a pixel apart; again on finer gold, up to 64x, in
/// bricks whose bound there exceeds epsilon or the certificate's total. Requires the samplers that `stored`
/// says hold and that this device has, image3d only on the device that built the volume; then computes again
/// what else `stored` says (docs/error-bounds.md, "What verify compares"). Does not check hashes: the caller
/// does, from the file. Cost: views * rows * columns^2 a few times on the host, 7 * views multiply-adds for
/// each node a quarter of a pixel apart across z on each detector row, as many as there are rows for each
/// gold node (of cone beam 64 * views for each node at about 8x), and what `build` takes to filter, to
/// reconstruct the base and to measure the tested bricks. Throws ResourceError when --max-memory is too small
/// for one row of bricks and one view.
VDVR_API VerifyResult verify(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                             const Certificate& stored, const VerifyOptions& options = {},
                             const Progress& progress = {});

}  // namespace vdvr
