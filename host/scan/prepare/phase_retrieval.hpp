// Paganin's phase retrieval of one view (Journal of Microscopy 206, 2002, 33).
#pragma once

#include "host/base/opencl/host_fft.hpp"
#include "host/scan/prepare/view_filters.hpp"
#include "vdvr/expert/preparation_steps.hpp"

namespace vdvr {

/// d lambda (delta / beta) / (4 pi) in mm^2: what |k|^2 is multiplied by.
double paganin_area_mm2(const PhaseRetrieval& phase);
/// Millimetres of a unit by its name (m, cm, mm, um, nm, ...). Throws InputError, which says how to name it.
double millimetres_of(const std::string& unit);

/// The filter for views of one size. Views are mirrored up to powers of two of at least twice their size.
class PaganinFilter {
 public:
  /// Pitches and the area in the same unit. Throws InputError where the padded view has over 2^31 samples.
  PaganinFilter(std::int64_t columns, std::int64_t rows, double pitch_u, double pitch_v, double area);
  /// Line integrals p become -log of the filtered exp(-p). A filtered transmission is positive, since the
  /// filter's kernel is. Cost: some 10 N log2 N for the N samples of the padded view.
  void apply(View& view) const;
  /// Bytes that apply() needs.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  std::int64_t columns_, rows_;  // padded
  double pitch_u_, pitch_v_, area_;
  fft::HostFft across_, along_;
};

}  // namespace vdvr
