// What a filter errs on what a cone-beam view adds along a line of nodes, against waves evaluated directly.
#define BOOST_TEST_MODULE projective_error
#include "host/certify/kept/projective_error.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <complex>
#include <random>
#include <ranges>
#include <vector>

#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

// (1 + rho t)^-2 exp(i omega t / (1 + rho t)): lambda^-2 times a wave of the detector, t nodes away.
std::complex<double> wave(double omega, double rho, double t) {
  const double growth = 1 + rho * t;
  return std::polar(1 / (growth * growth), omega * t / growth);
}

// |filtered - wave| at a phase. A real part of it times any factor of modulus 1 is a real field of sup 1.
double error_of(const GoldFilter& f, int phase, double omega, double rho) {
  std::complex<double> sum = -1;
  const double place = static_cast<double>(phase) / f.rate;
  for (int i = 0; i < f.taps; ++i)
    sum += static_cast<double>(f.weights[static_cast<std::size_t>(phase * f.taps + i)]) *
           wave(omega, rho, f.first() + i - place);
  return std::abs(sum);
}

double largest_error(const GoldFilter& f, double band, double rho) {
  constexpr int steps = 200;
  double largest = 0;
  for (int phase = 0; phase < f.rate; ++phase)
    for (int i = -steps; i <= steps; ++i)
      largest = std::max(largest, error_of(f, phase, band * i / steps, rho));
  return largest;
}

struct Designed {
  int rate, taps;
  double band;
};
// Waves of no more than a filter is made for, and of a third more: most views' are below the highest.
constexpr std::array designs{Designed{2, 20, 0.5}, Designed{2, 20, 1.2}, Designed{2, 20, 1.6},
                             Designed{4, 20, 1.4}, Designed{8, 16, 1.5}, Designed{4, 8, 0.8}};

BOOST_AUTO_TEST_CASE(no_wave_seen_in_perspective_exceeds_its_bound) {
  double closest = 0;
  for (const Designed& d : designs) {
    const GoldFilter filter = design_gold_filter(d.rate, d.band, d.taps);
    const double highest = std::min(d.band * 4 / 3, highest_gold_band);
    const ProjectiveError bound(filter, highest);
    for (const double share : {0.04, 0.3, 0.5, 0.75, 0.9, 1.0})
      for (const double rho : {0.0, 1e-4, -1e-3, 3e-3, -1e-2, 2e-2, -2e-2, 0.04}) {
        const double band = share * highest, error = largest_error(filter, band, rho),
                     most = bound.at(band, rho);
        BOOST_TEST(error <= tolerance::bound(most), "rate " << d.rate << ", " << d.taps << " taps, band "
                                                            << band << ", rho " << rho << ": error " << error
                                                            << ", bound " << most);
        closest = std::max(closest, error / most);
      }
    BOOST_TEST_MESSAGE("rate " << d.rate << ", " << d.taps << " taps, band " << d.band << ": closest "
                               << closest);
  }
  BOOST_TEST(closest > 0.3);
}

// As cone_tiles asks for it: most parts are passed over.
BOOST_AUTO_TEST_CASE(the_largest_part_is_found_without_the_sums_of_all) {
  std::mt19937 random(11);
  const auto unit = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (const Designed& d : designs) {
    const double highest = std::min(d.band * 4 / 3, highest_gold_band);
    const ProjectiveError error(design_gold_filter(d.rate, d.band, d.taps), highest);
    for (int tries = 0; tries < 10; ++tries) {
      std::vector<std::vector<ViewAtPart>> parts(100);
      double largest = 0;
      // Bounds of many parts, whose views nearly all do not grow, lie above the largest sum's.
      const double decoy = highest * (0.5 + 0.5 * unit());
      for (std::size_t i = 0; i < 30; ++i) parts[i] = {{60, decoy, 0}, {1e-9, decoy, 0.03}};
      parts[30] = {{60 * 1.01, decoy, 0}};
      for (auto& part : parts | std::views::take(31)) largest = std::max(largest, sum_of_errors(part, error));
      for (auto& part : parts | std::views::drop(31)) {
        const double share = unit(), growth = 0.03 * unit();
        for (int k = 0; k < 40; ++k) {
          part.push_back(
              {k % 7 == 0 ? 0.0 : unit(), highest * std::pow(unit(), 1 + share), growth * (2 * unit() - 1)});
          // At the edges of what shares its constants, and where nothing grows.
          if (k % 5 == 0)
            part.back().band =
                highest * static_cast<double>(1 + random() % ProjectiveError::bands) / ProjectiveError::bands;
          if (k % 3 == 0) part.back().rho = 0;
        }
        double sum = 0;
        for (const ViewAtPart& view : part) sum += view.weight * error.at(view.band, view.rho);
        BOOST_TEST(sum == sum_of_errors(part, error), boost::test_tools::tolerance(1e-13));
        BOOST_TEST(sum <= most_of_errors(part, error));
        largest = std::max(largest, sum);
      }
      const double found = largest_of_errors(parts, error);
      BOOST_TEST(largest <= found);
      BOOST_TEST(found <= largest * (1 + 2e-12));
    }
  }
}

// The nearer the source, the larger; towards it as away from it.
BOOST_AUTO_TEST_CASE(bounds_grow_with_perspective) {
  const GoldFilter filter = design_gold_filter(2, 1.2, 20);
  const ProjectiveError bound(filter, 1.2);
  double before = 0;
  for (const double rho : {0.0, 1e-3, 1e-2, 3e-2}) {
    const double most = bound.at(1.2, rho), error = largest_error(filter, 1.2, rho);
    BOOST_TEST_MESSAGE("rho " << rho << ": error " << error << ", bound " << most);
    BOOST_TEST(most >= before);
    BOOST_TEST(most == bound.at(1.2, -rho));
    BOOST_TEST(error > 0);
    before = most;
  }
}

BOOST_AUTO_TEST_CASE(a_copy_errs_by_nothing_and_what_is_out_of_reach_has_no_bound) {
  const ProjectiveError copy(design_gold_filter(1, 1.2, 20), 1.2);
  BOOST_TEST(copy.at(1.2, 0.01) == 0);
  const ProjectiveError bound(design_gold_filter(2, 1.2, 20), 1.2);
  BOOST_TEST(std::isinf(bound.at(1.3, 0.01)));
  BOOST_TEST(std::isinf(bound.at(1.2, 0.06)));
}

}  // namespace
}  // namespace vdvr
