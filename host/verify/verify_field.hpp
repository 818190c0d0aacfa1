// The bound on |V - F| as `verify` computes it, gold cell by gold cell, at every rate that is asked for
// (docs/error-bounds.md, "What verify does"). Shares with build only the sampler header. Calls
// verify_parts.cpp and verify_pieces.cpp; F is that of witness/nodes.hpp, of either beam.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/verify/witness/cone_bounds.hpp"
#include "host/verify/witness/nodes.hpp"
#include "host/volume/sampler/device_field.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/mixed_volume.hpp"

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
    int rate = 1;                       ///< of the gold
    Index3 first_cell{0, 0, 0};         ///< where it begins: gold cells inside the brick
    std::int64_t cells = 0, nodes = 0;  ///< tested: gold cells, and gold nodes that are their corners
    double error = 0;                   ///< largest |V - F| at nodes of cells whose corners are covered
    double total = -1;                  ///< bound of |V - F| on the tested cells; negative: none
    Index3 worst_cell{0, 0, 0};         ///< gold cell inside the brick
    double constant = 0;                ///< what `total` holds beside a column's own total
    std::span<const Column> columns{};  ///< [y][x] of the piece's side; total < 0: untested
    double unit = 1;                    ///< of what columns hold
    double arithmetic = 0;              ///< what F may err at a node
  };

  /// Computed F at a node, in world units.
  struct Node {
    Vec3 at{0, 0, 0};
    double value = 0, arithmetic = 0;
  };

  /// `field` outlives this object. All it is given and gives is in world units, but for columns: the device
  /// works in densities of 2^density (units.hpp). Throws ResourceError when memory does not suffice.
  VerifyField(opencl::State& state, const ExactField& field, const MixedVolume& volume,
              const std::optional<std::pair<double, double>>& window, const Progress& progress,
              int density = 0);

  /// Nodes to a cell of the grid that determine F across z: with fewer, gold is back-projected itself.
  [[nodiscard]] int across() const { return across_; }
  /// Of cone beam: finer gold, which is made of more nodes around a brick, is better asked for by itself.
  [[nodiscard]] bool nodes_are_dear() const { return !field_.views().empty(); }
  /// Of parallel beam, whether the detector's rows are no more than what so many layers of bricks take of
  /// heights: then they are made, and serve all layers.
  [[nodiscard]] bool rows_serve(std::int64_t layers) const;
  /// Of these bricks those that can hold a tested cell.
  [[nodiscard]] std::vector<std::uint8_t> near_coverage(std::vector<std::uint8_t> selected) const;
  /// The least rate of gold on whose cells the brick is trilinear.
  [[nodiscard]] int least_rate(std::size_t brick) const;

  /// What gold is made of: nodes of its own rate, or of `across()` where that is coarser; or of fewer nodes,
  /// so far apart as F allows.
  enum class Made { dense, sparse };
  /// Of cone beam, whether sparse nodes for gold of these rates are at most `worth` times as many as dense
  /// ones for the first rate alone, and F that is made of them errs by at most `most`, world units, about.
  [[nodiscard]] bool sparse_nodes_serve(const std::vector<std::uint8_t>& selected, std::span<const int> rates,
                                        double worth, double most) const;

  /// Measures bricks on gold of the rates, ascending; of dense nodes more than one only where each is a
  /// multiple of `across()`. `wants` is asked of each selected brick at each rate, and at a rate only when
  /// all pieces of the one before are known. Calls back once for each piece, in no particular order, and for
  /// a brick of which gold of that rate tests no cell with an empty one.
  void run(const std::vector<std::uint8_t>& selected, std::span<const int> rates,
           const std::function<bool(std::size_t brick, int rate)>& wants,
           const std::function<void(const Piece&)>& on_piece, const Progress& progress,
           Made made = Made::dense);
  void run(const std::vector<std::uint8_t>& selected, int rate,
           const std::function<void(const Piece&)>& on_piece, const Progress& progress) {
    run(
        selected, std::span(&rate, 1), [](std::size_t, int) { return true; }, on_piece, progress);
  }

  /// From now on, so many nodes of each of these bricks are kept at each rate, at one height each time, drawn
  /// by chance among those of covered points.
  void look_at(const std::vector<std::size_t>& bricks, std::int64_t nodes_each, unsigned seed);
  [[nodiscard]] const std::vector<Node>& seen() const { return seen_; }

  /// The most that the last run's computation of F may err at any node.
  [[nodiscard]] double arithmetic() const { return arithmetic_; }
  /// Whether the certificate speaks of a point.
  [[nodiscard]] bool covered(const Vec3& point) const {
    return coverage_.margin(point[0], point[1]) >= 0 && coverage_.margin_z(point[2]) >= 0;
  }

 private:
  struct Shape;
  struct Batch;
  struct Slab;
  struct Part;
  [[nodiscard]] std::vector<Part> parts_of(const std::vector<std::uint8_t>& selected,
                                           std::span<const int> rates, Made made) const;
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> joined(std::vector<std::vector<std::uint8_t>> layers,
                                                              const std::vector<std::uint8_t>& selected,
                                                              Made made) const;
  /// How nodes lie, and how far around what is asked for.
  struct Spread {
    int across = 1, along = 1, points = 12;
    std::int64_t around = 0, beyond = 0;  ///< nodes across z, and along it
  };
  [[nodiscard]] Spread spread_of(std::span<const int> rates, Made made) const;
  /// Heights to a cell of the grid that determine F along z, or `most`.
  [[nodiscard]] int nodes_along(int most) const;
  [[nodiscard]] VerifyNodes::Part nodes_of(const std::vector<std::uint8_t>& selected,
                                           std::span<const int> rates, bool rows, Made made) const;
  [[nodiscard]] Shape shape_at(int rate, bool many, const VerifyNodes::Part& part) const;
  [[nodiscard]] ConeBox group_box(std::int64_t group, int rate, const VerifyNodes::Part& part) const;
  [[nodiscard]] std::int64_t group_of(std::int64_t brick) const;
  /// What the nodes of a part may take of the device.
  [[nodiscard]] std::uint64_t part_bytes() const;
  [[nodiscard]] bool far_from_sources(const VerifyNodes::Part& part) const;
  [[nodiscard]] std::vector<std::int64_t> groups_of(const std::vector<std::uint8_t>& selected) const;
  [[nodiscard]] std::map<std::int64_t, FieldBounds> bounds_of_groups(
      const Shape& shape, const ConeNodeFacts& facts, const std::vector<std::int64_t>& groups) const;
  [[nodiscard]] const FieldBounds& bounds_of(const Shape& shape, std::int64_t brick) const;
  [[nodiscard]] std::vector<Slab> slabs_of(const Shape& shape,
                                           const std::vector<std::uint8_t>& selected) const;
  void run_slab(const Shape& shape, const std::vector<std::array<std::int64_t, 2>>& blocks,
                const std::vector<std::uint8_t>& selected, const std::function<void(const Piece&)>& on_piece);
  Batch make_batch(const Shape& shape, std::span<const std::array<std::int64_t, 2>> blocks,
                   const std::vector<std::uint8_t>& selected) const;
  struct Layers {
    int first, last, in_first, in_last;
  };
  [[nodiscard]] Layers covered_cells(const Shape& shape) const;
  [[nodiscard]] std::vector<double> constants_of(const Batch& batch, const Shape& shape,
                                                 const std::vector<cl_float8>& rows) const;
  void measure(const Batch& batch, const Shape& shape, const opencl::DeviceArray<float>& values,
               const std::function<void(const Piece&)>& on_piece);
  void look(const Batch& batch, const Shape& shape, const opencl::DeviceArray<float>& values);

  opencl::State& state_;
  const ExactField& field_;
  const MixedVolume& volume_;
  double unit_;                                      // of densities on the device
  std::optional<std::pair<double, double>> window_;  // in it
  Coverage coverage_;
  SupsByView sups_;
  DeviceField stored_;
  ConeNodeRates rates_of_cone_, sparse_rates_;
  int across_;
  VerifyNodes nodes_;
  std::map<std::int64_t, FieldBounds> of_groups_;  // cone beam: at this rate
  double arithmetic_ = 0;
  std::vector<std::uint8_t> looked_at_;  // bricks
  std::int64_t nodes_each_ = 0;
  std::mt19937 random_;
  std::vector<Node> seen_;
};

}  // namespace vdvr
