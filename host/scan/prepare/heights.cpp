#include "host/scan/prepare/heights.hpp"

#include "host/scan/prepare/common_heights.hpp"
#include "host/scan/prepare/series_of_heights.hpp"
#include "host/scan/prepare/upright_rows.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

void bring_to_heights(ProjectionSet& scan, const Preparation& wanted, std::uint64_t max_memory_bytes,
                      const std::filesystem::path& scratch) {
  ParallelGeometry& g = scan.geometry;
  scan.report.preparation.heights = {};
  if (wanted.heights == Heights::as_seen) return;
  if (g.axis_roll_deg != 0) {
    if (wanted.heights == Heights::all)
      throw InputError(
          "heights: all of them are put together of views about an axis that stands upright, and this one "
          "leans; `heights` common takes those that all views see");
    return upright_rows(scan, max_memory_bytes, scratch);
  }
  if (g.row_shift.empty()) return;
  const std::int64_t common = count_of_common_heights(g);
  if (wanted.heights == Heights::common || (!wanted.heights && 2 * common >= g.rows))
    return common_heights(scan, max_memory_bytes, scratch);
  const HeightSeries series = series_of(g, wanted.half_acquisition.value_or(false));
  const WeightsByHeight weights(series);
  if (!wanted.heights && common > 0) {
    const auto& covered = weights.covered();
    if (covered.size() != 1 || covered.front().count <= common)
      return common_heights(scan, max_memory_bytes, scratch);
  }
  series_of_heights(scan, series, weights, max_memory_bytes, scratch);
}

}  // namespace vdvr
