#include "host/certify/gold/prepared_scan.hpp"

#include <algorithm>
#include <bit>

#include "host/field/fdk/filter_cone.hpp"

namespace vdvr {
namespace {

// Of the line integrals and the geometry: one scan read again has the same, another's differs but by an
// accident of 2^-64.
std::uint64_t checksum(const ProjectionSet& scan) {
  std::uint64_t sum = 0xcbf29ce484222325u;
  const auto add = [&](std::uint64_t word) { sum = std::rotl((sum ^ word) * 0x9e3779b97f4a7c15u, 29); };
  for (const float v : scan.data) add(std::bit_cast<std::uint32_t>(v));
  const ParallelGeometry& g = scan.geometry;
  for (const double v : g.theta_rad) add(std::bit_cast<std::uint64_t>(v));
  for (const double v : {g.pitch_u, g.pitch_v, g.center}) add(std::bit_cast<std::uint64_t>(v));
  add(static_cast<std::uint64_t>(g.rows));
  add(static_cast<std::uint64_t>(g.columns));
  if (scan.cone) {
    for (const ViewMatrix& matrix : scan.cone->views)
      for (const auto& row : matrix)
        for (const double m : row) add(std::bit_cast<std::uint64_t>(m));
    add(static_cast<std::uint64_t>(scan.cone->redundancy));
  }
  return sum;
}

bool is_same_grid(const Grid& a, const Grid& b) {
  return a.cells == b.cells && a.origin == b.origin && a.spacing == b.spacing;
}

FieldSups sups_of(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                  PreparedScan::Sups wanted) {
  const std::int64_t views = scan.geometry.views();
  if (!scan.views.empty())
    return cone_sups(state, upsampler, scan,
                     wanted == PreparedScan::Sups::estimated
                         ? std::max<std::int64_t>(1, views / PreparedScan::estimate_views)
                         : 1);
  if (wanted == PreparedScan::Sups::of_values) return value_sups(state, upsampler, scan);
  const bool all = wanted == PreparedScan::Sups::of_derivatives;
  return field_sups(state, upsampler, scan,
                    all ? 1 : std::max<std::int64_t>(1, views / PreparedScan::estimate_views));
}

}  // namespace

PreparedScan::PreparedScan(opencl::State& device, const ScanInUnits& from, const FieldOptions& field,
                           Sups wanted, const Progress& progress)
    : shared(device.shared_from_this()),
      state(device),
      units(from.units),
      filtered(filter_scan(device, from.scan, field, progress, Precision::fp64, units)),
      upsampler(device, filtered, ColumnMethod::accurate),
      sups(sups_of(device, upsampler, filtered, wanted)),
      host_(device),
      field_(field),
      checksum_(checksum(from.scan)) {
  host_.count(filtered.samples.resident_bytes(), "the projections, filtered,");
}

bool PreparedScan::is_of(const opencl::State& device, const ScanInUnits& from,
                         const FieldOptions& field) const {
  return &device == &state && field.filter == field_.filter && field.cutoff == field_.cutoff &&
         field.center == field_.center && from.units == units && checksum(from.scan) == checksum_;
}

std::shared_ptr<GoldSource> PreparedScan::source(const GoldSettings& s) {
  if (!source_ || !is_same_grid(s.grid, settings_.grid) || s.granularity != settings_.granularity ||
      s.upsampling != settings_.upsampling || s.interpolation != settings_.interpolation ||
      gold_reach(s) > gold_reach(settings_)) {
    source_ = nullptr;  // before the next one is allocated
    source_ = std::make_shared<GoldSource>(state, filtered, sups, s);
    settings_ = s;
  }
  return source_;
}

}  // namespace vdvr
