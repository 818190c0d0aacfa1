// The certificate measured again, from the projections and the packed volume alone.
#pragma once

#include "vdvr/certificate.hpp"
#include "vdvr/device.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/projections.hpp"

namespace vdvr {

struct VerifyOptions {
  bool exhaustive = false;  ///< every gold node; otherwise a stratified sample of bricks and the worst ones
  double fraction = 0.05;   ///< of the bricks, when not exhaustive
  unsigned seed = 1;
};

struct VerifyResult {
  bool holds = false;
  double epsilon_abs = 0;
  double measured_max = 0, measured_total = 0, total = 0;
  Vec3 worst_at{0, 0, 0};
  std::int64_t bricks_tested = 0, bricks = 0, nodes_tested = 0;
  std::string failure;  ///< one line: what does not match, and where; empty when it holds
};

/// Recomputes gold and P and T from `scan` with the rates and field options of `stored`, samples `volume`
/// with the shared sampler, and compares. Does not check hashes: the caller does, from the file.
VerifyResult verify(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                    const Certificate& stored, const VerifyOptions& options = {},
                    const Progress& progress = {});

}  // namespace vdvr
