// F and the bound on |V - F| as `verify` computes them: from the cosine coefficients of the filtered
// projections in double precision, by six-point interpolation on fine columns, gold cell by gold cell, at the
// volume's gold rate or a finer one (docs/error-bounds.md, "What verify does"). Shares with build only the
// sampler header. Called by verify.cpp. Launches kernels/verify/verify_field.cl.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "host/fbp/coverage.hpp"
#include "host/opencl/array.hpp"
#include "host/sampler/device_field.hpp"
#include "host/verify/verify_bounds.hpp"
#include "vdvr/exact_field.hpp"
#include "vdvr/mixed_volume.hpp"

namespace vdvr {

class VerifyField {
 public:
  /// One column of gold cells, as verify_cells writes it, in the device's unit.
  struct Column {
    float total, error;
    std::int32_t worst_z, pad;
  };
  static_assert(sizeof(Column) == 16);

  /// A brick, or a cube of 64 gold cells a side of one.
  struct Piece {
    std::int64_t brick = 0;
    Index3 first_cell{0, 0, 0};         ///< where it begins: gold cells inside the brick
    std::int64_t cells = 0, nodes = 0;  ///< tested: gold cells, and gold nodes that are their corners
    double error = 0;                   ///< largest |V - F| at those nodes
    double total = -1;                  ///< bound of |V - F| on the tested cells; negative: none
    Index3 worst_cell{0, 0, 0};         ///< gold cell inside the brick
    double constant = 0;                ///< what `total` holds beside a column's own total
    std::span<const Column> columns;    ///< [y][x] of the piece's side; total < 0: untested
    double unit = 1;                    ///< of what columns hold
  };

  /// `field` outlives this object. All it is given and gives is in world units, but for columns: the device
  /// works in densities of 2^density (units.hpp). Throws ResourceError when memory does not suffice.
  VerifyField(opencl::State& state, const ExactField& field, const MixedVolume& volume,
              const std::optional<std::pair<double, double>>& window, const Progress& progress,
              int density = 0);

  /// Measures the selected bricks on gold of `rate`, a multiple of the volume's by a power of two; calls back
  /// once for each of their pieces, in no particular order.
  void run(const std::vector<std::uint8_t>& selected, int rate,
           const std::function<void(const Piece&)>& on_piece, const Progress& progress);

  /// What the last run's computation of F may err at any node.
  [[nodiscard]] double arithmetic() const { return arithmetic_; }

 private:
  struct Shape;
  struct Table;
  struct Batch;
  [[nodiscard]] Shape shape_at(int rate, bool many) const;
  void run_slab(const Shape& shape, const std::vector<std::array<std::int64_t, 2>>& blocks,
                const std::vector<std::uint8_t>& selected, const std::function<void(const Piece&)>& on_piece,
                const std::function<void(std::size_t)>& tick);
  Batch make_batch(const Shape& shape, std::span<const std::array<std::int64_t, 2>> blocks,
                   const std::vector<std::uint8_t>& selected) const;
  void fill(Table& table, const Shape& shape, std::int64_t first_view);
  void field_of(const Batch& batch, const Shape& shape, Table& table, opencl::DeviceArray<float>& values);
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> covered_cells(const Shape& shape) const;
  void measure(const Batch& batch, const Shape& shape, const opencl::DeviceArray<float>& values,
               const std::function<void(const Piece&)>& on_piece);

  opencl::State& state_;
  const ExactField& field_;
  const MixedVolume& volume_;
  double unit_;                                      // of densities on the device
  std::optional<std::pair<double, double>> window_;  // in it
  Coverage coverage_;
  ViewSups sups_;
  DeviceField stored_;
  std::int64_t pad_ = 0, columns_ = 0;  // fine columns
  double arithmetic_ = 0;
};

}  // namespace vdvr
