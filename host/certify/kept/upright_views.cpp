#include "host/certify/kept/upright_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/system/casts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

static_assert(sizeof(UprightRow<float>) == 32 && sizeof(UprightRow<double>) == 48);

// Beyond it a table would take several times the rows.
constexpr double most_shear = 2, most_wedge = 0.25;

TableAxis axis_of(double low, double high, double entries) {
  constexpr double around = 2;  // pixels: what eight taps reach
  TableAxis out{low - around, entries, 0, 0};
  out.count = static_cast<std::int64_t>(std::ceil((high - low + 2 * around) * entries)) + 8;
  return out;
}

}  // namespace

bool is_upright(const ViewMatrix& m) { return m[0][2] == 0 && m[2][2] == 0; }

// Rows of the matrix are added up so that z goes from the first and the last.
UprightViews::UprightViews(std::span<const ViewMatrix> views, const ParallelGeometry& detector)
    : middle_u_(0.5 * static_cast<double>(detector.columns - 1)),
      middle_v_(0.5 * static_cast<double>(detector.rows - 1)),
      half_u_(0.5 * static_cast<double>(detector.columns)),
      half_v_(0.5 * static_cast<double>(detector.rows)) {
  for (std::size_t k = 0; k < views.size(); ++k) {
    const ViewMatrix& m = views[k];
    ViewMatrix out{};
    const double along_u = m[0][2] - middle_u_ * m[2][2], along_v = m[1][2] - middle_v_ * m[2][2];
    const Lean lean{along_u / along_v, m[2][2] / along_v};
    if (!(std::abs(lean.shear) <= most_shear && std::abs(lean.wedge) * half_v_ <= most_wedge))
      throw InputError(fmt::format(
          "cone beam: the columns of view {} lean too far from the axis for a certificate (by {:.3g} "
          "columns a row, {:.3g} of the distance to the source over the detector): look at its "
          "matrix or at the tilts",
          k, lean.shear, 2 * lean.wedge * half_v_));
    for (std::size_t j = 0; j < 4; ++j) {
      const double u = m[0][j] - middle_u_ * m[2][j], v = m[1][j] - middle_v_ * m[2][j];
      out[2][j] = j == 2 ? 0.0 : m[2][j] - lean.wedge * v;
      out[0][j] = j == 2 ? 0.0 : u - lean.shear * v + middle_u_ * out[2][j];
      out[1][j] = v + middle_v_ * out[2][j];
    }
    views_.push_back(out);
    leans_.push_back(lean);
  }
}

// What a pixel of the upright detector moves on the leaning one: 1 - wedge V along a row, along a column that
// and shear - wedge U besides.
void UprightViews::set_table(double entries, const std::array<double, 2>& beyond,
                             const std::array<double, 2>& low, const std::array<double, 2>& high) {
  constexpr double around = 2;
  const double u = half_u_ + beyond[0] + around, v = half_v_ + beyond[1] + around;
  double across = 1, along = 1;
  for (const Lean& lean : leans_) {
    const double scale = 1 + std::abs(lean.wedge) * v;
    across = std::max(across, scale);
    along = std::max(along, scale * (scale + std::abs(lean.shear) + std::abs(lean.wedge) * u));
  }
  columns_ = axis_of(low[0], high[0], entries * across);
  rows_ = axis_of(low[1], high[1], entries * along);
  for (const Lean& lean : leans_) {
    const double scale = 1 + std::abs(lean.wedge) * v;
    wedge_ = std::max(wedge_, std::abs(lean.wedge) * scale / rows_.density);
    grow_ = std::max({grow_, std::abs(entries * scale / columns_.density - 1),
                      std::abs(entries * (2 - scale) / columns_.density - 1)});
  }
}

// The step's rounding times columns, the place's, and the part's.
double UprightViews::place_error(double unit) const {
  return unit * (2.01 * grow_ * static_cast<double>(columns_.count) + 2);
}

template <class Real>
std::vector<UprightRow<Real>> UprightViews::rows_of(std::size_t view, const UpsampledColumns& columns,
                                                    const UpsampledColumns& rows) const {
  const Lean& lean = leans_[view];
  std::vector<UprightRow<Real>> out;
  out.reserve(at(rows_.count));
  for (std::int64_t r = 0; r < rows_.count; ++r) {
    const double V = rows_.position(r) - middle_v_, U = columns_.position(0) - middle_u_,
                 scale = 1 / std::max(0.5, 1 + lean.wedge * V),
                 v = rows.column_of(middle_v_ + V * scale) - 0.5,
                 u = columns.column_of(middle_u_ + (U + lean.shear * V) * scale) - 0.5;
    const auto last_row = static_cast<double>(rows.count - 8);
    UprightRow<Real> row{};
    row.part_u = static_cast<Real>(u - std::round(u));
    row.grow_u = static_cast<Real>(scale * static_cast<double>(columns.rate) / columns_.density - 1);
    row.part_v = static_cast<Real>(v - std::round(v));
    row.weight = static_cast<Real>(scale * scale);
    row.column = static_cast<std::int32_t>(std::round(u)) - 3;
    row.row = static_cast<std::int32_t>(std::clamp(std::round(v) - 3, 0.0, last_row));
    out.push_back(row);
  }
  return out;
}

template std::vector<UprightRow<float>> UprightViews::rows_of(std::size_t, const UpsampledColumns&,
                                                              const UpsampledColumns&) const;
template std::vector<UprightRow<double>> UprightViews::rows_of(std::size_t, const UpsampledColumns&,
                                                               const UpsampledColumns&) const;

}  // namespace vdvr
