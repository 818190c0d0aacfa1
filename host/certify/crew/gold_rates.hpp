// Gold at the rate that certifies, at half of it, and at twice (docs/error-bounds.md, section 14).
#pragma once

#include <algorithm>
#include <memory>
#include <optional>

#include "host/certify/gold/gold_stream.hpp"

namespace vdvr {

/// Gold at three rates, each of which bounds |V - F| by the theorem of its own. The coarse one decides most
/// bricks for an eighth of the work. What it leaves undecided the fine one tests, at the rate of the plan.
/// The few bricks that differ from that by less than the tolerance, but not by as much less as T takes, are
/// tested at twice the rate, where T is a quarter.
class GoldRates {
 public:
  GoldRates(opencl::State& state, const FilteredScan& scan, const FieldSups& sups, GoldSettings settings,
            std::shared_ptr<GoldSource> source = nullptr);
  [[nodiscard]] GoldStream& fine() { return *fine_; }
  [[nodiscard]] const GoldStream& fine() const { return *fine_; }
  /// None where rate < 4, where slack does not count or where a window is given.
  [[nodiscard]] GoldStream* coarse() { return coarse_ ? &*coarse_ : nullptr; }
  /// None where there is no coarse one, or where filters or coordinates do not allow it.
  [[nodiscard]] GoldStream* finer() { return finer_ ? &*finer_ : nullptr; }
  /// Of one of its rates; throws std::logic_error where it is none.
  [[nodiscard]] GoldStream& of(int rate);
  /// Of the largest block of any.
  [[nodiscard]] Index3 block_bricks() const { return (coarse_ ? *coarse_ : *fine_).block_bricks(); }

  /// fp32 error bound of any gold sample of any rate: positions in blocks of coarse gold reach farther.
  [[nodiscard]] double arithmetic() const { return largest(&GoldStream::arithmetic); }
  /// P of any rate.
  [[nodiscard]] double projection() const { return largest(&GoldStream::projection); }

 private:
  [[nodiscard]] double largest(double (GoldStream::*term)() const) const {
    double out = 0;
    for (const auto* gold : {&fine_, &coarse_, &finer_})
      if (*gold) out = std::max(out, ((**gold).*term)());
    return out;
  }
  std::optional<GoldStream> fine_, coarse_, finer_;
};

}  // namespace vdvr
