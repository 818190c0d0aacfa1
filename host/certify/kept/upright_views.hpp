// Of detectors that lean: those that would stand upright at the same source and see the same rays. A column
// of theirs stands along z, so that a column of nodes lies in one of them, at one lambda
// (docs/error-bounds.md, section 16).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "host/field/fbp/cosine_series.hpp"
#include "vdvr/expert/cone_geometry.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Whether a view's columns stand along z.
[[nodiscard]] bool is_upright(const ViewMatrix& matrix);

/// One axis of a table of values on a detector.
struct TableAxis {
  double first = 0, density = 1;  ///< a place of the detector, and entries a pixel
  std::int64_t pad = 0;           ///< entries before that place
  std::int64_t count = 0;
  [[nodiscard]] double column_of(double x) const { return (x - first) * density + static_cast<double>(pad); }
  [[nodiscard]] double position(std::int64_t j) const {
    return first + static_cast<double>(j - pad) / density;
  }
};

/// Where a row of an upright view's table reads the leaning one's, as kernels/certify/kept/upright_table.cl
/// has it.
template <class Real>
struct UprightRow {
  Real part_u, grow_u, part_v, weight;
  std::int32_t column, row, unused[2];
};

class UprightViews {
 public:
  /// Throws InputError where a view's columns lean by more than can be told from rows.
  UprightViews(std::span<const ViewMatrix> views, const ParallelGeometry& detector);

  /// Their matrices. Places are pixels still, and those in the middle of the detector are where they were.
  [[nodiscard]] const std::vector<ViewMatrix>& views() const { return views_; }
  /// Sets the table's axes: values that lie dense enough for the leaning detector's, `entries` a pixel of it,
  /// on which places are looked at up to `beyond` pixels outside, by axis; `low` and `high`: the places that
  /// are read, in pixels of the upright ones.
  void set_table(double entries, const std::array<double, 2>& beyond, const std::array<double, 2>& low,
                 const std::array<double, 2>& high);
  [[nodiscard]] const TableAxis& columns() const { return columns_; }
  [[nodiscard]] const TableAxis& rows() const { return rows_; }
  /// By how much a view's scale changes from a row of the table to the next, at most, over that scale.
  [[nodiscard]] double wedge() const { return wedge_; }
  /// Entries of the leaning table that places in it err, in numbers of unit roundoff `unit`.
  [[nodiscard]] double place_error(double unit) const;
  /// How the rows of a view's table are made of a table of the leaning detector.
  template <class Real>
  [[nodiscard]] std::vector<UprightRow<Real>> rows_of(std::size_t view, const UpsampledColumns& columns,
                                                      const UpsampledColumns& rows) const;

 private:
  // With U and V from the detector's middle: upright ones are (U - shear V) / (1 - wedge V), V / (1 - wedge
  // V).
  struct Lean {
    double shear = 0, wedge = 0;
  };
  std::vector<ViewMatrix> views_;
  std::vector<Lean> leans_;
  double middle_u_, middle_v_, half_u_, half_v_;
  TableAxis columns_, rows_;
  double wedge_ = 0, grow_ = 0;
};

}  // namespace vdvr
