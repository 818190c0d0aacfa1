// Launches in pieces: how they are cut, that kernels do not see it, and that what they take is learnt.
#define BOOST_TEST_MODULE pace
#include <boost/test/unit_test.hpp>

#include "host/base/opencl/pace.hpp"
#include "host/base/opencl/state.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/resident_volume.hpp"
#include "vdvr/expert/verify.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;
using namespace vdvr::testing;
using opencl::Cut;
using opencl::Pace;

BOOST_AUTO_TEST_CASE(an_unknown_kernel_shows_a_small_part_first) {
  const Pace pace;
  const Cut cut = opencl::cut_of({3, 640, 640}, 32, pace, 0.25, true);
  BOOST_TEST(cut.axis == 2u);
  BOOST_TEST(cut.groups == 10u);
  BOOST_TEST(opencl::cut_of({3, 640, 640}, 32, pace, 0.25, false).groups == 640u);
  BOOST_TEST(opencl::cut_of({5, 1, 1}, 32, pace, 0.25, true).groups == 1u);
}

BOOST_AUTO_TEST_CASE(pieces_take_no_longer_than_asked) {
  Pace pace;
  pace.learn(1e-3, 1000);  // a microsecond a work-item
  constexpr double longest = 0.01;
  for (const std::uint64_t side : {1, 7, 100, 1000}) {
    const Cut cut = opencl::cut_of({side, 3, 2}, 64, pace, longest, true);
    const double each = 1e-6 * 64 * 3 * 2;
    if (side >= 3) BOOST_TEST(cut.axis == 0u);
    const double piece = cut.axis == 0 ? each * static_cast<double>(cut.groups) : 0;
    BOOST_TEST((piece <= longest || cut.groups == 1));
    if (each * static_cast<double>(side) <= longest) BOOST_TEST(cut.groups >= (cut.axis == 0 ? side : 3));
  }
}

BOOST_AUTO_TEST_CASE(a_small_launch_says_little_of_a_large_one) {
  Pace pace;
  pace.learn(1, 1000000);
  pace.learn(1, 10);
  BOOST_TEST(pace.seconds_per_item() == 1e-6);
  pace.learn(1, 500000);
  BOOST_TEST(pace.seconds_per_item() == 2e-6);
}

namespace {

struct Everything {
  std::string hash;
  double worst = 0;
  std::uint64_t tested = 0;
  PixelBounds pixels;
  std::uint64_t launches = 0;
};

// A build, its verification and a certified picture, with launches of `longest` seconds at most.
Everything everything(const ProjectionSet& scan, const Grid& grid, double longest) {
  Device device;
  device.state().longest_launch = longest;
  PlanSettings settings;
  settings.granularity = 4;
  Plan plan = make_plan(device, scan, grid, {}, {}, Tolerance{0.08, {}}, settings);
  const BuildResult built = build(device, scan, plan, {});
  Everything out;
  out.hash = content_sha256(built.volume);
  const VerifyResult verdict = verify(device, scan, built.volume, built.certificate);
  out.worst = verdict.measured_total;
  out.tested = verdict.bricks_tested;
  const ResidentVolume resident(device, built.volume);
  RenderOptions o;
  o.width = o.height = 40;
  o.camera = orbit_camera(grid, 33, 19, 1);
  o.transfer = TransferFunction{"soft",
                                {{resident.value_range().first, {0.1, 0.2, 0.9}, 0},
                                 {resident.value_range().second, {1, 0.8, 0.2}, 0.2}}};
  o.sampler = SamplerKind::buffer;
  out.pixels = certify_pixels(
      device, resident, std::vector<float>(static_cast<std::size_t>(built.volume.brick_count()), 0.01f), o);
  out.launches = device.state().launches();
  return out;
}

void pieces_change_nothing(const ProjectionSet& scan, const Grid& grid) {
  const Everything whole = everything(scan, grid, 1e3), pieces = everything(scan, grid, 1e-5);
  BOOST_TEST(pieces.launches > 2 * whole.launches);
  BOOST_TEST(pieces.hash == whole.hash);
  BOOST_TEST(pieces.worst == whole.worst);
  BOOST_TEST(pieces.tested == whole.tested);
  BOOST_TEST(pieces.pixels.lo.values == whole.pixels.lo.values, boost::test_tools::per_element());
  BOOST_TEST(pieces.pixels.hi.values == whole.pixels.hi.values, boost::test_tools::per_element());
}

}  // namespace

BOOST_AUTO_TEST_CASE(nothing_that_is_computed_depends_on_pieces) {
  const ProjectionSet scan = noise_scan(16, 7, 15);
  pieces_change_nothing(scan, grid_of(scan, {13, 13, 7}, 0.8));
}

BOOST_AUTO_TEST_CASE(nor_of_cone_beam) {
  const ProjectionSet scan = noisy_cone({});
  pieces_change_nothing(scan, grid_of(Coverage(scan.geometry, scan.cone->views), 1.7));
}
