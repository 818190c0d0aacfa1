// A scan as planning leaves it to the build that follows: filtered, with its sups and the gold that is kept.
// Made by plan.cpp; taken over by build.cpp where the scan is the same.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "host/base/opencl/host_memory.hpp"
#include "host/certify/bounds/projection_bounds.hpp"
#include "host/certify/gold/gold_source.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "host/scan/units.hpp"

namespace vdvr {

/// What a preparation is of. Its user can change a scan between plan and build, and read it again: samples
/// are told by a checksum, another scan's differs but by an accident of 2^-64. Cost: a pass over them.
struct PreparedOf {
  PreparedOf(const opencl::State& state, const ScanInUnits& from, const FieldOptions& field);
  bool operator==(const PreparedOf&) const = default;

  const opencl::State* state;
  FieldOptions field;
  Units units;
  ParallelGeometry geometry;
  std::optional<ConeGeometry> cone;
  std::uint64_t samples;
};

struct PreparedScan {
  /// Of which views sups are taken, and whether of derivatives too, which interpolation by two or four taps
  /// needs.
  enum class Sups { of_values, of_derivatives, estimated };
  /// Views that an estimate looks at.
  static constexpr std::int64_t estimate_views = 24;

  /// Filters and bounds. Keeps the state: a plan that has it may outlive its Device.
  PreparedScan(opencl::State& state, const ScanInUnits& from, const FieldOptions& field, Sups sups,
               const Progress& progress);
  PreparedScan(const PreparedScan&) = delete;
  PreparedScan& operator=(const PreparedScan&) = delete;

  /// What gold of these settings reads: rates that differ in gold alone share it.
  std::shared_ptr<GoldSource> source(const GoldSettings& settings);

  std::shared_ptr<opencl::State> shared;  ///< first: what follows counts its memory there to the last
  opencl::State& state;
  const PreparedOf of;
  FilteredScan filtered;
  Upsampler upsampler;
  FieldSups sups;

 private:
  HostMemory host_;
  std::shared_ptr<GoldSource> source_;
  GoldSettings settings_;  // of source_
};

}  // namespace vdvr
