// Gold at the rate that certifies, at half of it, and at finer ones (docs/error-bounds.md, section 14).
#pragma once

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>

#include "host/certify/gold/gold_stream.hpp"

namespace vdvr {

/// Gold at several rates, each of which bounds |V - F| by the theorem of its own. The coarse one decides most
/// bricks for an eighth of the work. What it leaves undecided the fine one tests, at the rate of the plan;
/// the few bricks that differ from gold by less than the tolerance, but not by as much less as T takes, are
/// tested at finer rates, whose T is a quarter and a sixteenth.
class GoldRates {
 public:
  GoldRates(opencl::State& state, const FilteredScan& scan, const FieldSups& sups, GoldSettings settings,
            std::shared_ptr<GoldSource> source = nullptr);
  [[nodiscard]] GoldStream& fine() { return *fine_; }
  [[nodiscard]] const GoldStream& fine() const { return *fine_; }
  /// None where rate < 4, where slack does not count or where a window is given.
  [[nodiscard]] GoldStream* coarse() { return coarse_ ? &*coarse_ : nullptr; }
  /// Ascending; none where there is no coarse one.
  [[nodiscard]] std::deque<GoldStream>& sharper() { return sharper_; }
  /// Of one of its rates; throws std::logic_error where it is none.
  [[nodiscard]] GoldStream& of(int rate);
  /// Of the largest block of any.
  [[nodiscard]] Index3 block_bricks() const { return (coarse_ ? *coarse_ : *fine_).block_bricks(); }

  /// fp32 error bound of any gold sample of any rate: positions in blocks of coarse gold reach farther.
  [[nodiscard]] double arithmetic() const {
    return largest([](const GoldStream& gold) { return gold.arithmetic(); });
  }
  /// P of any rate.
  [[nodiscard]] double projection() const {
    return largest([](const GoldStream& gold) { return gold.projection(); });
  }

 private:
  [[nodiscard]] double largest(const auto& of) const {
    double out = std::max(of(*fine_), coarse_ ? of(*coarse_) : 0.0);
    for (const GoldStream& gold : sharper_) out = std::max(out, of(gold));
    return out;
  }
  std::optional<GoldStream> fine_, coarse_;
  std::deque<GoldStream> sharper_;
};

}  // namespace vdvr
