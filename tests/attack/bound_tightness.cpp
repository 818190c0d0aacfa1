// How tight the bounds on gold are: the largest T and P beside the largest truth, which a finer gold shows,
// on the bricks with the largest T and some by chance (docs/error-bounds.md, sections 6 and 16). scripts/long
// bound-tightness makes the table of cone beam.
//   bound_tightness SCAN [GOLD]

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>

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
  // Of cone beam there is one way to gold: the finer one has the same nodes, and no error of P shows.
  const auto ratio = [](double bound, double error) {
    return error > 0 ? fmt::format("{:.2f}", bound / error) : std::string("-");
  };
  fmt::print("| scan | gold | T | largest error | ratio | P | largest error | ratio | A |\n");
  fmt::print("| {} | {}x | {:.5f} | {:.5f} | {} | {:.3g} | {:.3g} | {} | {:.3g} |\n", argv[1], rates.gold,
             t.gold_bound, t.gold_error, ratio(t.gold_bound, t.gold_error), t.projection_bound,
             t.projection_error, ratio(t.projection_bound, t.projection_error), t.arithmetic);
  return 0;
}
