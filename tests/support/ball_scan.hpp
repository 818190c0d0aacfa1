// Projections of one ball off the middle, by rays that a test lays as a format's own documentation does, and
// what must come out: the ball where it is and nothing where a mirror or a wrong turn would put it.
#pragma once

#include <functional>

#include "host/scan/geometry/vectors.hpp"
#include "tests/support/cone_files.hpp"
#include "vdvr/expert/exact_field.hpp"

namespace vdvr::support {

struct BallScan {
  static constexpr int views = 60, rows = 18, columns = 24;
  static constexpr double radius = 4;
  static constexpr Vec3 center{7, 3, -4};  ///< no mirror image and no quarter turn of it meets it

  /// Of the ray from a source through a pixel; all in the frame in which the ball stands at `ball`.
  static double chord(const Vec3& source, const Vec3& pixel, const Vec3& ball) {
    const Vec3 way = sum(pixel, scaled(source, -1)), to = sum(ball, scaled(source, -1));
    const double distance = length(cross(way, to)) / length(way);
    return distance < radius ? 2 * std::sqrt(radius * radius - distance * distance) : 0;
  }

  /// float samples[view][row][column].
  static std::vector<float> samples(const std::function<double(int view, int row, int column)>& integral) {
    std::vector<float> out;
    for (int k = 0; k < views; ++k)
      for (int v = 0; v < rows; ++v)
        for (int u = 0; u < columns; ++u) out.push_back(static_cast<float>(integral(k, v, u)));
    return out;
  }
};

/// F at the ball's middle and at its images. A ball of density 1 gives about 1 in its middle and little far
/// from it; half of it tells them apart.
inline void check_ball(const ProjectionSet& scan) {
  std::vector<Vec3> points;
  for (const double x : {1.0, -1.0})
    for (const double y : {1.0, -1.0})
      for (const double z : {1.0, -1.0})
        for (const bool turned : {false, true}) {
          const Vec3& c = BallScan::center;
          points.push_back({x * c[turned ? 1 : 0], y * c[turned ? 0 : 1], z * c[2]});
        }
  const ExactField field(scan, {});
  for (const Vec3& p : points) BOOST_REQUIRE(field.covered(p));
  const std::vector<double> values = field.at(points);
  BOOST_TEST(values[0] > 0.5);
  for (std::size_t i = 1; i < points.size(); ++i)
    BOOST_TEST(values[i] < 0.5, "at " << points[i][0] << " " << points[i][1] << " " << points[i][2]);
}

}  // namespace vdvr::support
