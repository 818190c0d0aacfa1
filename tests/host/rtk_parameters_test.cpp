// Parameters of matrices, and RTK's file of them.
#define BOOST_TEST_MODULE rtk_parameters
#include <boost/test/unit_test.hpp>
#include <optional>
#include <sstream>

#include "tests/support/cone_files.hpp"
#include "vdvr/expert/rtk_geometry.hpp"

using namespace vdvr;
using namespace vdvr::support;

extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

// --- back to parameters ---

BOOST_AUTO_TEST_CASE(parameters_of_a_matrix_give_it_back) {
  CircularView v;
  v.source_to_axis = 500;
  v.source_to_detector = 900;
  v.pitch_u = 0.2;
  v.pitch_v = 0.3;
  v.center = 255.5;
  v.row = 127.5;
  v.in_plane_rad = 0.03;
  v.out_of_plane_rad = -0.05;
  v.source_offset_u = 3;
  v.source_offset_v = -2;
  v.detector_offset_u = 11;
  v.detector_offset_v = 7;
  for (const double theta : {-3.0, 0.0, 0.5, 2.0, 3.1}) {
    v.theta_rad = theta;
    const CircularView back = circular_parameters(circular_view(v), 0.2, 0.3, 255.5, 127.5);
    for (const auto& [a, b] :
         std::vector<std::pair<double, double>>{{back.theta_rad, v.theta_rad},
                                                {back.in_plane_rad, v.in_plane_rad},
                                                {back.out_of_plane_rad, v.out_of_plane_rad},
                                                {back.source_to_axis, v.source_to_axis},
                                                {back.source_to_detector, v.source_to_detector},
                                                {back.source_offset_u, v.source_offset_u},
                                                {back.source_offset_v, v.source_offset_v},
                                                {back.detector_offset_u, v.detector_offset_u},
                                                {back.detector_offset_v, v.detector_offset_v}})
      // Some hundred roundings of numbers up to the source's distance.
      BOOST_TEST(std::abs(a - b) <= tolerance::fp64_sum(200, 900));
  }
  BOOST_CHECK_THROW(static_cast<void>(circular_parameters(circular_view(v), 0.2, 0.2, 255.5, 127.5)),
                    InputError);
  ViewMatrix mirrored = circular_view(v);
  for (double& value : mirrored[0]) value = -value;
  BOOST_CHECK_THROW(static_cast<void>(circular_parameters(mirrored, 0.2, 0.3, 255.5, 127.5)), InputError);
}

BOOST_AUTO_TEST_CASE(geometry_written_for_rtk_is_read_back_the_same) {
  const Scan scan;
  const ProjectionSet plain = scan.read(scan.geometry({{"offset_u", 0.1}}));
  const StackPlace stack = centred_stack(columns, rows, plain.geometry.pitch_u, plain.geometry.pitch_v);
  static_cast<void>(scan.folder.file("g.xml", rtk_geometry_text(*plain.cone, stack)));
  static_cast<void>(scan.folder.file(
      "stack.mha",
      stack_bytes(columns, rows, views,
                  fmt::format("Offset = {:.17g} {:.17g} 0\nElementSpacing = {:.17g} {:.17g} 1\n",
                              stack.origin[0], stack.origin[1], stack.spacing[0], stack.spacing[1]))));
  BOOST_TEST(largest_difference(plain, scan.read({{"rtk_geometry", "g.xml"}})) <= same_geometry);
}
