// F is a sum over views, and along a straight ray of the plane each view's row is passed at a steady pace:
// its share of the integral is the length of the chord times the row's mean between the chord's ends.
#include "host/verify/residual/row_integrals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/system/parallel.hpp"
#include "host/verify/residual/primitives.hpp"
#include "vdvr/expert/exact_field.hpp"

namespace vdvr {
namespace {

constexpr double unit = 0x1p-53;

/// What one pass over some views adds for the rays of view j.
struct Pass {
  const ParallelGeometry& g;
  const CoveredChords& chords;
  std::size_t first_view;
  const std::vector<Primitive>& primitives;

  /// Adds to the row's integrals; what the primitives err, for the longest chord of the view.
  double add(std::size_t j, double longest, double* integral) const {
    const auto columns = static_cast<std::size_t>(g.columns);
    const double *first = chords.first.data() + j * columns, *last = chords.last.data() + j * columns;
    double error = 0;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Primitive& primitive = primitives[p];
      const double turn = g.theta_rad[first_view + p] - g.theta_rad[j], c = std::cos(turn),
                   s = std::sin(turn);
      const double center = g.center_of_view(first_view + p);
      for (std::size_t i = 0; i < columns; ++i) {
        if (!(first[i] < last[i])) continue;
        const double at = chords.u[j * columns + i] * c, from = (at + first[i] * s) / g.pitch_u + center,
                     to = (at + last[i] * s) / g.pitch_u + center;
        integral[i] += (last[i] - first[i]) * primitive.mean(from, to);
      }
      double slant = std::numeric_limits<double>::infinity();
      if (std::abs(s) > 0)
        slant = g.pitch_u / std::abs(s) * std::max(primitive.apart, kNarrow * primitive.anywhere);
      error += std::min(slant, longest * primitive.anywhere);
    }
    return error;
  }
};

}  // namespace

RowIntegrals row_integrals(const ProjectionSet& row, const FieldOptions& field, const CoveredChords& chords,
                           std::uint64_t table_bytes, const std::function<void(double)>& progress) {
  const ExactField exact(row, field);
  const ParallelGeometry& g = exact.geometry();
  const auto columns = static_cast<std::size_t>(g.columns), views = g.theta_rad.size();
  const PrimitiveMaker make(g.columns);
  const std::size_t together = std::clamp<std::size_t>(table_bytes / make.bytes(), 1, views);
  std::vector<double> longest(views), of_view(views);
  for (std::size_t ray = 0; ray < views * columns; ++ray)
    longest[ray / columns] = std::max(longest[ray / columns], chords.length(ray));

  RowIntegrals out;
  out.integral.resize(views * columns);
  double largest = 0, slope = 0;
  for (std::size_t k = 0; k < views; k += together) {
    std::vector<Primitive> primitives(std::min(together, views - k));
    parallel_for(static_cast<std::int64_t>(primitives.size()), {}, "antiderivatives", [&](std::int64_t p) {
      const auto i = static_cast<std::size_t>(p);
      primitives[i] = make(exact.coefficients().subspan((k + i) * columns, columns));
    });
    for (const Primitive& p : primitives) {
      largest += p.largest;
      slope += p.slope;
    }
    const Pass pass{g, chords, k, primitives};
    const double share = static_cast<double>(primitives.size()) / static_cast<double>(views);
    const auto within = [&](const std::string&, double part) {
      if (progress) progress(static_cast<double>(k) / static_cast<double>(views) + share * part);
    };
    parallel_for(g.views(), within, "line integrals", [&](std::int64_t j) {
      const auto view = static_cast<std::size_t>(j);
      of_view[view] += pass.add(view, longest[view], out.integral.data() + view * columns);
    });
  }

  // docs/residual.md, "Bounds": the series' coefficients, where the rays' ends are seen, and the sums.
  out.error.resize(views * columns);
  const auto [leftmost, rightmost] = std::minmax_element(chords.u.begin(), chords.u.end());
  const double far = *std::max_element(longest.begin(), longest.end()) + std::abs(*leftmost) +
                     std::abs(*rightmost),
               misplaced = unit * (16 * far / g.pitch_u + 8 * static_cast<double>(columns)),
               density =
                   exact.rounding() + misplaced * slope + unit * static_cast<double>(views + 16) * largest;
  for (std::size_t ray = 0; ray < views * columns; ++ray)
    if (chords.first[ray] < chords.last[ray])
      out.error[ray] = (1 + 1e-9) * (of_view[ray / columns] + chords.length(ray) * density);
  return out;
}

}  // namespace vdvr
