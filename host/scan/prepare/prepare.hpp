// The steps of a Preparation: on each view before it is rounded, then on the scan.
#pragma once

#include <cstdint>
#include <memory>

#include "host/scan/prepare/phase_retrieval.hpp"
#include "host/scan/prepare/view_filters.hpp"
#include "vdvr/expert/preparation_steps.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Replaces outliers by the median of their window; returns how many there were.
std::int64_t remove_outliers(View& view, const Outliers& outliers);

/// What is done to a view while it is read: outliers and phase. One object may be used by several threads.
class ViewPreparation {
 public:
  /// `geometry` as the file has it. Throws InputError for phase retrieval of cone beam, of counts that were
  /// not given, or of a unit without a length.
  ViewPreparation(const Preparation& preparation, const ParallelGeometry& geometry, bool cone);
  [[nodiscard]] bool none() const { return !preparation_.outliers && !phase_; }
  /// Bytes for each thread.
  [[nodiscard]] std::uint64_t bytes() const { return phase_ ? phase_->bytes() : 0; }
  /// Returns how many outliers were replaced.
  std::int64_t apply(View& view) const;

 private:
  Preparation preparation_;
  std::unique_ptr<PaganinFilter> phase_;
};

/// Stripes, median, blur and binning of a whole scan, whose geometry is changed with it; notes say what was
/// found. The centre must be known, or is found afterwards. `max_memory_bytes`: 0 for no limit. Throws
/// InputError where binning leaves no pixel.
void prepare_scan(ProjectionSet& scan, const Preparation& preparation, std::uint64_t max_memory_bytes,
                  const Progress& progress);

}  // namespace vdvr
