// Densities do not depend on how views are spread over all directions, and wedges are told. Random scans of
// ten kinds, held to the same disc at equal angles; `view_weights_test -- N` tries N of each beam.
#define BOOST_TEST_MODULE view_weights
#include "host/scan/geometry/view_weights.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <numeric>
#include <random>

#include "host/field/fdk/fdk_weights.hpp"
#include "host/scan/geometry/cone_views.hpp"
#include "tests/support/angle_scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using namespace vdvr::testing;

namespace {

constexpr double pi = std::numbers::pi, degree = pi / 180;

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

std::vector<double> radians(Angles angles) {
  for (double& a : angles) a *= degree;
  return angles;
}

// What one view adds to F, for its weight, in the mean over points inside a disc off the axis: a function of
// the view's angle alone, tabulated. Fan beam where the source's distance is given.
class DiscByAngle {
 public:
  explicit DiscByAngle(double source_to_axis) {
    for (std::size_t i = 0; i < table_.size(); ++i)
      table_[i] = of(2 * pi * static_cast<double>(i) / static_cast<double>(table_.size()), source_to_axis);
  }
  [[nodiscard]] double field(const std::vector<double>& theta, const std::vector<double>& weight) const {
    double f = 0;
    for (std::size_t k = 0; k < theta.size(); ++k) f += weight[k] * at(theta[k]);
    return f;
  }
  [[nodiscard]] double field_of_equal_angles(std::size_t views, double period) const {
    const auto n = static_cast<double>(views);
    double f = 0;
    for (std::size_t k = 0; k < views; ++k) f += at(period * static_cast<double>(k) / n) * pi / n;
    return f;
  }

 private:
  static constexpr int columns = 65;
  static constexpr double middle = 32, radius = 10, away = 8;

  [[nodiscard]] double at(double theta) const {
    const auto n = static_cast<double>(table_.size());
    const double place = (theta / (2 * pi) - std::floor(theta / (2 * pi))) * n;
    const auto i = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(i);
    return (1 - share) * table_[i % table_.size()] + share * table_[(i + 1) % table_.size()];
  }
  // Line integrals, their ramp filter by the closed form, linear interpolation.
  static double of(double theta, double distance) {
    const double c = std::cos(theta), s = std::sin(theta);
    std::array<double, columns> row{}, filtered{};
    for (std::size_t i = 0; i < columns; ++i) {
      const double u = static_cast<double>(i) - middle;
      // From the line of the ray to the disc's middle.
      const double slant = distance > 0 ? std::hypot(distance, u) / distance : 1;
      const double off = distance > 0 ? (u * (1 - away * s / distance) - away * c) / slant : u - away * c;
      row[i] = 2 * std::sqrt(std::max(0.0, radius * radius - off * off)) / slant;
    }
    for (std::size_t i = 0; i < columns; ++i)
      for (std::size_t j = 0; j < columns; ++j) {
        const auto n = static_cast<double>(i) - static_cast<double>(j);
        if (i == j) filtered[i] += 0.25 * row[j];
        else if ((i + j) % 2 == 1) filtered[i] -= row[j] / (pi * pi * n * n);
      }
    double mean = 0;
    int points = 0;
    for (int y = -4; y <= 4; ++y)
      for (int x = -4; x <= 4; ++x, ++points) {
        const double px = away + x, lambda = distance > 0 ? 1 - (px * s - y * c) / distance : 1;
        const double u = (px * c + y * s) / lambda + middle;
        const auto i = static_cast<std::size_t>(u);
        const double share = u - static_cast<double>(i);
        mean += ((1 - share) * filtered[i] + share * filtered[i + 1]) / (lambda * lambda);
      }
    return mean / points;
  }

  std::array<double, 4096> table_{};
};

constexpr double source_to_axis = 120;

ConeGeometry cone_of(const std::vector<double>& theta) {
  ConeGeometry cone;
  for (const double t : theta) {
    CircularView view;
    view.theta_rad = t;
    view.source_to_axis = view.source_to_detector = source_to_axis;
    view.center = 32;
    view.row = 2;
    cone.views.push_back(circular_view(view));
  }
  cone.redundancy = natural_redundancy(cone, 65);
  return cone;
}

struct Weighed {
  std::vector<double> weight;  // adding to pi
  std::vector<std::string> notes;
};

Weighed weighed(const std::vector<double>& theta, bool cone) {
  Weighed out;
  if (!cone) {
    const ViewWeights w = view_weights(theta);
    return {w.weight, w.notes};
  }
  const ConeGeometry geometry = cone_of(theta);
  const FdkWeights w(geometry, 65, 5);
  for (std::size_t k = 0; k < theta.size(); ++k) out.weight.push_back(w.of_view(k));
  out.notes = w.notes();
  // Those of a short scan mean nothing without its redundancy, and are told by the reader.
  if (geometry.redundancy == Redundancy::short_scan) out.notes.emplace_back("limited angle");
  return out;
}

bool says(const std::vector<std::string>& notes, const std::string& what) {
  return std::any_of(notes.begin(), notes.end(),
                     [&](const std::string& note) { return note.find(what) != std::string::npos; });
}

// What became of the scans of one kind.
struct Tally {
  int scans = 0, capped = 0, doubtful = 0, wrong = 0, silently_wrong = 0;
  double worst_sum = 0, worst = 0;
};

std::int64_t scans_asked_for() {
  const auto& suite = boost::unit_test::framework::master_test_suite();
  return suite.argc > 1 ? std::atoll(suite.argv[1]) : 400;
}

}  // namespace

BOOST_AUTO_TEST_CASE(random_scans_give_the_densities_of_equal_angles_or_say_why_not) {
  // The property of docs/geometry.md, "Weights of views".
  constexpr double density = 0.005;
  for (const bool cone : {false, true}) {
    const DiscByAngle disc(cone ? source_to_axis : 0);
    const double period = cone ? 2 * pi : pi;
    AngleScans scans(cone ? 2 : 1, cone ? 360 : 180);
    std::map<std::string, Tally> tallies;
    for (std::int64_t tried = 0; tried < scans_asked_for(); tried += 10)
      for (const auto& [kind, angles] : scans.whole()) {
        const std::vector<double> theta = radians(angles);
        const Weighed w = weighed(theta, cone);
        const double off_sum = std::abs(sum(w.weight) / pi - 1),
                     off = std::abs(
                         disc.field(theta, w.weight) / disc.field_of_equal_angles(theta.size(), period) - 1);
        Tally& tally = tallies[kind];
        ++tally.scans;
        const bool capped = says(w.notes, "limited angle"), doubtful = says(w.notes, "unequal angles");
        tally.capped += capped;
        tally.doubtful += doubtful;
        tally.wrong += !(off <= density);
        tally.silently_wrong += !(off <= density) && !capped && !doubtful;
        if (!capped) {
          tally.worst_sum = std::max(tally.worst_sum, off_sum);
          tally.worst = std::max(tally.worst, off);
          BOOST_TEST(off_sum <= tolerance::fp64_sum(static_cast<std::int64_t>(theta.size()), 4));
        }
      }
    for (const auto& [kind, t] : tallies) {
      BOOST_TEST_MESSAGE((cone ? "cone beam, " : "parallel beam, ")
                         << kind << ": " << t.scans << " scans, " << t.capped << " capped, " << t.doubtful
                         << " doubtful, " << t.wrong << " off by more than 0.5 %, " << t.silently_wrong
                         << " of them without a note; worst of the others " << t.worst);
      BOOST_TEST(t.silently_wrong == 0);
      // Random angles may leave a gap that no one can tell from a wedge; so may few bursts.
      if (kind != "random" && kind != "bursts") BOOST_TEST(t.capped == 0);
      BOOST_TEST(t.capped * 100 <= t.scans);
    }
  }
}

BOOST_AUTO_TEST_CASE(wedges_are_capped_and_told) {
  for (const bool cone : {false, true}) {
    AngleScans scans(cone ? 4 : 3, cone ? 360 : 180);
    std::map<std::string, Tally> tallies;
    for (std::int64_t tried = 0; tried < scans_asked_for(); tried += 10)
      for (const auto& [kind, angles] : scans.with_wedges()) {
        const std::vector<double> theta = radians(angles);
        // Cone beam by the period alone: a short scan is weighed on purpose.
        const ViewWeights w = view_weights(theta, cone ? 2 * pi : pi);
        Tally& tally = tallies[kind];
        ++tally.scans;
        tally.capped += w.wedges > 0 && sum(w.weight) < 0.97 * (cone ? 2 * pi : pi);
        tally.doubtful += w.wedges == 0 && says(w.notes, "unequal angles");
      }
    for (const auto& [kind, t] : tallies) {
      BOOST_TEST_MESSAGE((cone ? "cone beam, " : "parallel beam, ")
                         << kind << ": " << t.scans << " scans, " << t.capped << " capped, " << t.doubtful
                         << " doubtful");
      BOOST_TEST(t.capped == t.scans);
    }
  }
}

// What the issue of weights was about: a median of gaps by their number, which of these scans is tiny.
BOOST_AUTO_TEST_CASE(scans_over_whole_turns_see_every_direction) {
  std::mt19937 random(1);
  std::normal_distribution<double> jitter(0, 0.02);
  Angles past, short_of, three_turns, two_densities, in_steps;
  for (int k = 0; k < 721; ++k) past.push_back(360.05 * k / 720);
  for (int k = 0; k < 361; ++k) short_of.push_back(359.9 * k / 360);
  for (int k = 0; k < 360; ++k) three_turns.push_back(3 * k + jitter(random));
  for (int k = 0; k < 360; ++k) two_densities.push_back(0.25 * k);
  for (int k = 0; k < 60; ++k) two_densities.push_back(90 + 1.5 * k);
  for (int k = 0; k < 193; ++k) in_steps.push_back(1.4 * k);
  const DiscByAngle disc(0);
  for (const Angles& angles : {past, short_of, three_turns, two_densities, in_steps}) {
    const std::vector<double> theta = radians(angles);
    const ViewWeights w = view_weights(theta);
    BOOST_TEST(w.wedges == 0);
    BOOST_TEST(std::abs(sum(w.weight) - pi) <=
               tolerance::fp64_sum(static_cast<std::int64_t>(theta.size()), 2 * pi));
    const double equal = disc.field_of_equal_angles(theta.size(), pi);
    BOOST_TEST(std::abs(disc.field(theta, w.weight) - equal) <= 0.005 * equal);
  }
}

BOOST_AUTO_TEST_CASE(views_of_one_direction_weigh_alike_and_are_refused) {
  const double same = tolerance::fp64_sum(8, 2 * pi);
  for (const Angles& angles :
       {Angles{0, 0, 0, 0, 0}, Angles{0, 180, 360, 180, 0}, Angles{40, 40.3, 220.1, 40.2, 220}}) {
    const ViewWeights w = view_weights(radians(angles));
    for (const double weight : w.weight) BOOST_TEST(std::abs(weight - pi / 5) <= same);
    BOOST_CHECK_THROW(require_directions(w), InputError);
  }
  // Opposite sources are two directions of cone beam.
  BOOST_CHECK_NO_THROW(require_directions(view_weights(radians({0, 180, 360}), 2 * pi)));
  BOOST_CHECK_THROW(FdkWeights(cone_of(radians({7, 7, 7})), 65, 5), InputError);
}

BOOST_AUTO_TEST_CASE(radians_taken_for_degrees_are_refused) {
  Angles half_turn, turn, short_arc;
  for (int k = 0; k < 180; ++k)
    half_turn.push_back(pi * k / 180), turn.push_back(2 * pi * k / 180), short_arc.push_back(0.1 * k);
  BOOST_CHECK_THROW(require_directions(view_weights(radians(half_turn))), InputError);
  BOOST_CHECK_THROW(require_directions(view_weights(radians(turn))), InputError);
  BOOST_CHECK_NO_THROW(require_directions(view_weights(radians(short_arc))));
}

// Of formats that have radians.
BOOST_AUTO_TEST_CASE(degrees_taken_for_radians_are_refused) {
  const auto check = [](double step, int views) {
    std::vector<double> angles;
    for (int k = 0; k < views; ++k) angles.push_back(step * k);
    io::require_radians("g.json", "ProjectionAngles", angles);
  };
  BOOST_CHECK_THROW(check(2, 180), FileError);
  BOOST_CHECK_THROW(check(0.5, 361), FileError);
  BOOST_CHECK_NO_THROW(check(2 * pi / 180, 180));
  // The golden angle over many turns.
  BOOST_CHECK_NO_THROW(check(pi * (std::sqrt(5.0) - 1) / 2, 400));
}

BOOST_AUTO_TEST_CASE(views_that_nearly_coincide_share_the_weight_of_their_direction) {
  Angles angles;
  for (int k = 0; k < 36; ++k) angles.push_back(5 * k);
  for (const double aside : {-0.03, -0.01, 0.02, 0.05}) angles.push_back(90 + aside);
  const std::vector<double> weight = view_weights(radians(angles)).weight;
  BOOST_TEST(std::abs(sum(weight) - pi) <= tolerance::fp64_sum(40, 2 * pi));
  // Their mean is a thousandth of the step off.
  for (std::size_t k = 36; k < 40; ++k) {
    BOOST_TEST(weight[k] == weight[18]);
    BOOST_TEST(std::abs(5 * weight[k] - 5 * degree) <= 0.01 * degree);
  }
}

// Four steps at either side of a wedge, of which an end view has half.
BOOST_AUTO_TEST_CASE(a_view_beside_a_wedge_weighs_two_and_a_half_steps) {
  const auto arc = [](double from, double to, double step) {
    Angles out;
    for (double a = from; a < to; a += step) out.push_back(a);
    return out;
  };
  const double same = tolerance::fp64_sum(400, 2 * pi);
  const auto check = [&](Angles angles, int wedges, double seen_deg) {
    const ViewWeights w = view_weights(radians(std::move(angles)));
    BOOST_TEST(w.wedges == wedges);
    BOOST_TEST(says(w.notes, "limited angle"));
    BOOST_TEST(std::abs(sum(w.weight) - seen_deg * degree) <= same);
  };
  check(arc(0, 140.5, 1), 1, 144);
  check(arc(0, 60.5, 1), 1, 64);
  BOOST_TEST(std::abs(view_weights(radians(arc(0, 140.5, 1))).weight.front() - 2.5 * degree) <= same);
  Angles two = arc(0, 50.5, 1), more = arc(80, 150.5, 1);
  two.insert(two.end(), more.begin(), more.end());
  check(two, 2, 128);
  // A stray view in the middle of a wedge has four steps.
  Angles stray = arc(0, 120.5, 1);
  stray.push_back(150);
  check(stray, 2, 128);
  BOOST_TEST(std::abs(view_weights(radians(stray)).weight.back() - 4 * degree) <= same);
}

BOOST_AUTO_TEST_CASE(coarse_parts_are_filled_and_told) {
  Angles angles;
  for (int k = 0; k < 1500; ++k) angles.push_back(0.1 * k);
  for (int k = 0; k < 6; ++k) angles.push_back(150 + 5 * k);
  const ViewWeights w = view_weights(radians(angles));
  BOOST_TEST(w.wedges == 0);
  BOOST_TEST(says(w.notes, "unequal angles: gaps between views reach 5 degrees"));
  BOOST_TEST(std::abs(sum(w.weight) - pi) <= tolerance::fp64_sum(1506, 2 * pi));
}

// A step of a scan that comes round thrice is no opening of its orbit, and a wedge within a short scan is
// told.
BOOST_AUTO_TEST_CASE(what_the_orbit_of_cone_beam_leaves_open_is_told_from_coarse_steps) {
  std::mt19937 random(1);
  std::normal_distribution<double> jitter(0, 0.01);
  Angles steps, open;
  for (int k = 0; k < 36; ++k) steps.push_back(30 * k + jitter(random));
  BOOST_TEST((cone_of(radians(steps)).redundancy == Redundancy::full_turn));
  BOOST_TEST(!says(weighed(radians(steps), true).notes, "limited angle"));
  for (int k = 0; k < 230; ++k)
    if (k < 100 || k > 115) open.push_back(k);
  const ConeGeometry cone = cone_of(radians(open));
  BOOST_TEST((cone.redundancy == Redundancy::short_scan));
  BOOST_TEST(says(FdkWeights(cone, 65, 5).notes(), "no view sees a wedge of 17.0 degrees"));
}
