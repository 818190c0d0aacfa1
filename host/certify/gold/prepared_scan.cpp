#include "host/certify/gold/prepared_scan.hpp"

#include <algorithm>
#include <bit>

#include "host/field/fdk/filter_cone.hpp"

namespace vdvr {
namespace {

std::uint64_t checksum(const SampleArray& samples) {
  std::uint64_t sum = 0xcbf29ce484222325u;
  for (const float v : samples)
    sum = std::rotl((sum ^ std::bit_cast<std::uint32_t>(v)) * 0x9e3779b97f4a7c15u, 29);
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

PreparedOf::PreparedOf(const opencl::State& on, const ScanInUnits& from, const FieldOptions& wanted)
    : state(&on),
      field(wanted),
      units(from.units),
      geometry(from.scan.geometry),
      cone(from.scan.cone),
      samples(checksum(from.scan.data)) {}

PreparedScan::PreparedScan(opencl::State& device, const ScanInUnits& from, const FieldOptions& field,
                           Sups wanted, const Progress& progress)
    : shared(device.shared_from_this()),
      state(device),
      of(device, from, field),
      filtered(filter_scan(device, from.scan, field, progress, Precision::fp64, of.units)),
      upsampler(device, filtered, ColumnMethod::accurate),
      sups(sups_of(device, upsampler, filtered, wanted)),
      host_(device) {
  host_.count(filtered.samples.resident_bytes(), "the projections, filtered,");
}

std::shared_ptr<GoldSource> PreparedScan::source(const GoldSettings& s) {
  if (!source_ || !is_same_grid(s.grid, settings_.grid) || s.granularity != settings_.granularity ||
      s.upsampling != settings_.upsampling || s.interpolation != settings_.interpolation ||
      s.part != settings_.part || gold_reach(s) > gold_reach(settings_)) {
    source_ = nullptr;  // before the next one is allocated
    source_ = std::make_shared<GoldSource>(state, filtered, sups, s);
    settings_ = s;
  } else if (s.differences != settings_.differences) {
    if (source_->remainder) source_->take_differences(s);
    settings_.differences = s.differences;
  }
  return source_;
}

}  // namespace vdvr
