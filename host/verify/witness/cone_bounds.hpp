// The constants of field_bounds.hpp for cone beam, on a box: derivatives of lambda^-2 q(u, v) from the sups
// of q on the detector, and what computed nodes err (docs/error-bounds.md, "What verify does", "Cone beam").
// Shares nothing with build but the views' matrices.
#pragma once

#include <span>

#include "host/verify/witness/cone_nodes.hpp"
#include "host/verify/witness/field_bounds.hpp"
#include "vdvr/expert/cone_geometry.hpp"

namespace vdvr {

/// Of cone beam per pixel, everywhere on the detector's plane: view_sups of a detector of pitch 1.
SupsByView cone_view_sups(const ExactField& field, const Progress& progress);

struct ConeBox {
  Vec3 low{}, high{};
};

/// What errors of gold depend on: the path from nodes, and these themselves.
struct ConePath {
  /// `host_rounding`: of the table's double-precision values, weights of lambda not included.
  ConePath(const NodePath& from, const ConeNodeFacts& facts, double host_rounding);
  NodePath path;
  ConeNodeFacts nodes;
  double host_rounding = 0;
  AxisNorms across, along;  ///< of errors of nodes
};

/// Bounds on gold that reads nodes in the box only. `corrected`: whether second derivatives are taken to
/// fourth order in h. Throws InputError where the box reaches a source's plane. Cost: some 3,000 operations a
/// view.
FieldBounds cone_field_bounds(std::span<const ViewMatrix> views, const SupsByView& sups, const ConeBox& box,
                              const Vec3& gold_spacing, const ConePath& path, bool corrected);

/// At least |derivative of lambda^-2 q| of `orders` along x, y and z, anywhere on the box, times the spacing
/// to those orders. `value`, `second_u`, `second_v`: sups of |q|, |q_uu|, |q_vv| per pixel. For tests.
double cone_derivative(const ViewMatrix& view, const std::array<int, 3>& orders, double value,
                       double second_u, double second_v, const ConeBox& box, const Vec3& spacing);

}  // namespace vdvr
