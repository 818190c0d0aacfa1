// How tight the bounds on gold are: the largest T and P beside the largest truth, which a finer gold shows,
// on the bricks with the largest T and some by chance (docs/error-bounds.md, sections 6 and 16). scripts/long
// bound-tightness makes the table of cone beam.
//   bound_tightness SCAN [GOLD]

#include <cstdio>
#include <cstdlib>

#include "tests/support/measure_tightness.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/read_scan.hpp"

using namespace vdvr;

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: bound_tightness SCAN [GOLD]\n");
    return 2;
  }
  const ProjectionSet scan = read_scan(argv[1]);
  FieldOptions field;
  field.center = stated_center(field, scan.geometry);
  // Of cone beam gold is made of projections at 8x by six taps both ways.
  const Rates rates{8, scan.cone ? Interpolation::six_taps : Interpolation::linear,
                    argc > 2 ? std::atoi(argv[2]) : 8};
  Device device;
  const support::Tightness t =
      support::measure_tightness(device, scan, certified_grid(scan, field, {}), field, rates);
  std::printf("| scan | gold | T | largest error | ratio | P | largest error | ratio | A |\n");
  std::printf("| %s | %dx | %.5f | %.5f | %.2f | %.3g | %.3g | %.2f | %.3g |\n", argv[1], rates.gold,
              t.gold_bound, t.gold_error, t.gold_bound / t.gold_error, t.projection_bound, t.projection_error,
              t.projection_bound / t.projection_error, t.arithmetic);
  return 0;
}
