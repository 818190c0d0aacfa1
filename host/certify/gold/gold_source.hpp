// What streams of gold of one scan and grid share: the kept nodes and what T leaves out, brick by brick.
#pragma once

#include "host/certify/gold/gold_settings.hpp"
#include "host/certify/kept/brick_remainder.hpp"
#include "host/certify/kept/kept_gold.hpp"

namespace vdvr {

struct GoldSource {
  /// All but the settings is referred to.
  GoldSource(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
             const GoldSettings& settings);

  /// What T leaves out as these settings have it, of which nothing was looked at: gold stays kept.
  void take_differences(const GoldSettings& settings);

  KeptGold kept;
  std::optional<BrickRemainder> remainder;  ///< none where only base samples are asked for

 private:
  opencl::State& state_;
  const FilteredScan& scan_;
  const FieldSups& sups_;
};

/// How far beyond the covered region nodes of gold are wanted, in world units: those that may be stored, and
/// those around the cells that are tested.
double gold_reach(const GoldSettings& settings);
/// The same of every coarsening that these settings may be given: of cone beam all gold is made at once.
double reach_of_all(GoldSettings settings);

}  // namespace vdvr
