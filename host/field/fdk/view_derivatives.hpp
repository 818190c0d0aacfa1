// Derivatives of what one cone-beam view adds to F, lambda^-2 q(u, v): bounds on a box, and their sums over
// the views.
//
// With X_e = (n_u, n_v)_e - lambda_e (u, v), where (n_u, n_v, lambda) is the matrix times (x, y, z, 1), the
// derivative along directions e_1 .. e_n is
//   lambda^-(2+n) sum over subsets S of (n+1)! / (|S|+1)! prod over i not in S of (-lambda_ei) D_S q ,
// D_S q the derivative of q along the X_ei, i in S, which are not differentiated themselves. No band limit
// of F in space is needed, which F does not have; q has one on the detector.
#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "vdvr/expert/cone_geometry.hpp"

namespace vdvr {

/// Of one filtered view everywhere on the detector's plane, its mirror images included: pixels are the unit
/// of length. Frequencies along u and along v must not exceed pi radians a pixel.
struct DetectorSups {
  double value = 0;     ///< sup |q|
  double second_u = 0;  ///< sup |q_uu|
  double second_v = 0;  ///< sup |q_vv|
  // Infinite where nobody looked: Bernstein's inequality has bounds of them then.
  double fourth_u = HUGE_VAL;   ///< sup |q_uuuu|
  double second_uv = HUGE_VAL;  ///< sup |q_uuvv|
  double fourth_v = HUGE_VAL;   ///< sup |q_vvvv|
};

/// A convex piece of space, by its corners in any order.
using Corners = std::vector<Vec3>;
Corners box_corners(const Vec3& low, const Vec3& high);

/// What bounds of derivatives need of a view and a convex piece of space, by axis e of the world. In pixels
/// and the world's unit of length; rounded so that bounds hold.
struct ViewBox {
  double lambda_min = 0;      ///< <= 0, or not a number: the piece reaches the source's plane
  Vec3 along_u{}, along_v{};  ///< largest |X_e,u| and |X_e,v| on the piece
  Vec3 growth{};              ///< |lambda_e|
};
ViewBox view_box(const ViewMatrix& matrix, std::span<const Vec3> corners);
/// Of each view, by vectors of them: the same bits. Cost: some 60 operations a corner and
/// view.
void view_boxes(std::span<const ViewMatrix> views, std::span<const Vec3> corners, std::span<ViewBox> out);
inline ViewBox view_box(const ViewMatrix& matrix, const Vec3& low, const Vec3& high) {
  return view_box(matrix, box_corners(low, high));
}

/// At least |derivative of lambda^-2 q| of `orders` along x, y and z, together at most 6, anywhere on the
/// piece, per powers of the world's unit of length. Infinite where it reaches the source's plane.
double derivative_bound(const ViewBox& box, const std::array<int, 3>& orders, const DetectorSups& sups);

/// Bounds of the sixth derivatives that have even orders along all axes.
class SixthSups {
 public:
  /// `orders`: even, together 6.
  [[nodiscard]] double at(const std::array<int, 3>& orders) const { return sums_[place(orders)]; }
  /// Of the orders 2 along axes e, f and g, in any order and as often as they occur.
  [[nodiscard]] double along(int e, int f, int g) const;

 private:
  friend SixthSups sixth_sups(std::span<const ViewMatrix>, std::span<const DetectorSups>,
                              std::span<const Vec3>);
  static std::size_t place(const std::array<int, 3>& orders);
  std::array<double, 16> sums_{};  // [orders[0] / 2][orders[1] / 2]
};

/// Sums of derivative_bound over the views. Infinite where the piece reaches the source's plane of a view.
/// Cost: some 800 operations a view.
SixthSups sixth_sups(std::span<const ViewMatrix> views, std::span<const DetectorSups> sups,
                     std::span<const Vec3> corners);
inline SixthSups sixth_sups(std::span<const ViewMatrix> views, std::span<const DetectorSups> sups,
                            const Vec3& low, const Vec3& high) {
  return sixth_sups(views, sups, box_corners(low, high));
}

/// At least sum_k lambda^-power values[k], values >= 0, anywhere on the piece; infinite as above.
double sum_of_weights(std::span<const ViewMatrix> views, std::span<const double> values,
                      std::span<const Vec3> corners, int power);
inline double sum_of_weights(std::span<const ViewMatrix> views, std::span<const double> values,
                             const Vec3& low, const Vec3& high, int power) {
  return sum_of_weights(views, values, box_corners(low, high), power);
}

}  // namespace vdvr
