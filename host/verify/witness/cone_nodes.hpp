// Nodes of cone beam for `verify`: back-projected where they lie, by eight points of Lagrange both ways from
// tables of its own (docs/error-bounds.md, "What verify does", "Cone beam"). Shares nothing with build but
// the views' matrices. Launches kernels/verify/witness/verify_cone.cl.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/verify/witness/cosine_transform.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Values of the table to a pixel, along u at least so many and along v, and points of Lagrange between them.
constexpr std::int64_t cone_density = 6;
constexpr int cone_points = 8;
/// The sum of the magnitudes of their weights, at most, where the place lies between the two in the middle.
constexpr double sum_of_cone_weights = 1.4883;

/// Nodes to a cell of the grid with which they lie at most a quarter of the shortest wave's half apart, in
/// every view at the covered region's rim: powers of two, the same for x and y. 2^24 where none does.
struct ConeNodeRates {
  int across = 1, along = 1;
};
ConeNodeRates cone_node_rates(const ExactField& field, const Coverage& coverage, const Vec3& spacing);

/// So many that polynomials of `sparse_points` determine F between them about as well as those of twelve
/// points between the others, any numbers.
constexpr int sparse_points = 32;
ConeNodeRates sparse_node_rates(const ExactField& field, const Coverage& coverage, const Vec3& spacing);

/// What the errors of nodes depend on (cone_bounds.hpp).
struct ConeNodeFacts {
  double density_u = cone_density;  ///< values of the table to a pixel along u
  double place_u = 0, place_v = 0;  ///< by how much places err, in pixels
  double cancellation = 1;          ///< largest sum of magnitudes of what lambda is made of, over lambda
  /// Pixels along u for each along v by which the line of a column of nodes leans, at most, where rows are
  /// interpolated along it; 0: nowhere.
  double lean = 0;
  std::int64_t together = 1;  ///< views that are summed before they are added to the others
  std::int64_t calls = 1;     ///< so many such sums
};

class VerifyConeNodes {
 public:
  /// Refers to the field and the coverage. Values are in `unit`.
  VerifyConeNodes(opencl::State& state, const ExactField& field, const Coverage& coverage, double unit);

  /// Nodes [tile][y][x][heights] in tiles of VDVR_VERIFY_TILE columns a side.
  struct Nodes {
    Vec3 first{}, spacing{};                         ///< where the first lies, and how far apart they are
    std::int64_t heights = 0;                        ///< of a node, to a multiple of 16
    std::int64_t used = 0;                           ///< of the heights
    double furthest = 0;                             ///< beyond the covered region, across z, that is used
    std::vector<std::array<std::int64_t, 2>> tiles;  ///< wanted, by their first nodes x, y
    std::vector<std::uint8_t> blocks;                ///< [tile][heights / 16]: 0: not wanted; all where empty
    /// [tile]: in it the first and last x, then y, that are wanted; all where empty.
    std::vector<std::array<std::uint8_t, 4>> ranges;
  };
  /// Writes those tiles that are not too far out. Throws InputError where such a tile reaches a
  /// source's plane. Cost: columns * rows * (columns + 6 rows) * 6 multiply-adds a view on the host, or fewer
  /// where the nodes see but some of the rows; 64 a view and node on the device.
  ConeNodeFacts make(const Nodes& wanted, const opencl::DeviceArray<float>& nodes);

 private:
  struct Window;
  struct Table;
  [[nodiscard]] Window window_of(const Nodes& wanted, const std::vector<cl_int2>& tiles) const;
  void fill(Table& table, std::int64_t first_view) const;
  struct Tiles;
  void back_project(const Nodes& wanted, const Tiles& tiles, const Table& table,
                    const opencl::DeviceArray<float>& nodes, ConeNodeFacts& facts);

  opencl::State& state_;
  const ExactField& field_;
  const Coverage& coverage_;
  CosineTransform along_u_;
  std::array<double, 2> density_;  // of the table along u and v, places to a pixel
  double unit_;
  bool upright_;
};

}  // namespace vdvr
