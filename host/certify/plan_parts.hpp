// What a plan is to those who carry it out: in their units (units.hpp), as the scan prepared, and as
// settings of gold and of what is stored.
#pragma once

#include <memory>
#include <span>

#include "host/certify/gold/prepared_scan.hpp"
#include "host/scan/units.hpp"
#include "host/volume/choose_lattice.hpp"
#include "vdvr/expert/plan.hpp"

namespace vdvr {

/// What is given in `units` in world units.
Plan to_world(Plan plan, const Units& units);
Tolerance to_world(Tolerance tolerance, const Units& units);

/// Gold of a plan's grid, layout and comparison, at rates that it has chosen or tries.
GoldSettings gold_settings(const Plan& plan, const Rates& rates, bool cone);

/// The plan's own preparation, where it is of this scan, field and device; else one made anew.
std::shared_ptr<PreparedScan> preparation_of(opencl::State& state, const ScanInUnits& from, const Plan& plan,
                                             const Progress& progress);

/// Of integer samples of a base in `units`, as `epsilon_abs` is.
IntegerLattice lattice_of(std::span<const float> base, double epsilon_abs, const VolumeLayout& layout,
                          const Units& units, StorageChoice storage, const FilterErrors& filters);

}  // namespace vdvr
