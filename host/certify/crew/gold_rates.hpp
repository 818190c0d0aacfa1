// Gold at the rate that certifies, and at half of it (docs/error-bounds.md, section 14).
#pragma once

#include <algorithm>
#include <memory>
#include <optional>

#include "host/certify/gold/gold_stream.hpp"

namespace vdvr {

/// Gold at the rate that certifies, and at half of it where that can decide something: a stored field that is
/// within the tolerance by the coarse test is so by the theorem of that rate, for an eighth of the work.
class GoldRates {
 public:
  GoldRates(opencl::State& state, const FilteredScan& scan, const FieldSups& sups, GoldSettings settings,
            std::shared_ptr<GoldSource> source = nullptr);
  [[nodiscard]] GoldStream& fine() { return *fine_; }
  [[nodiscard]] const GoldStream& fine() const { return *fine_; }
  /// None where rate < 4, where slack does not count or where a window is given.
  [[nodiscard]] GoldStream* coarse() { return coarse_ ? &*coarse_ : nullptr; }
  /// Of the largest block of either.
  [[nodiscard]] Index3 block_bricks() const { return (coarse_ ? *coarse_ : *fine_).block_bricks(); }

  /// fp32 error bound of any gold sample of either rate: positions in blocks of coarse gold reach farther.
  [[nodiscard]] double arithmetic() const {
    return std::max(fine_->arithmetic(), coarse_ ? coarse_->arithmetic() : 0.0);
  }
  /// P of either rate.
  [[nodiscard]] double projection() const {
    return std::max(fine_->projection(), coarse_ ? coarse_->projection() : 0.0);
  }

 private:
  std::optional<GoldStream> fine_, coarse_;
};

}  // namespace vdvr
