#define BOOST_TEST_MODULE stripes
#include "host/scan/prepare/stripes.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "tests/support/scans.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/preparation.hpp"

using namespace vdvr;

namespace {

// One row of Shepp-Logan off its middle, with the noise of some 2,000 photons.
Sinogram clean_sinogram() {
  SimulateOptions options;
  options.columns = 321;
  options.rows = 1;
  options.angles = 360;
  const ProjectionSet scan = simulate(shepp_logan(150), options);
  Sinogram s{360, 321, std::vector<double>(scan.data.begin(), scan.data.end())};
  double most = 0;
  for (const double p : s.data) most = std::max(most, p);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.02);
  for (double& p : s.data) p = 2.5 * p / most + noise(random);
  return s;
}

using Spoil = std::function<void(Sinogram&, std::int64_t column, std::mt19937&)>;

// The kinds of stripe of Vo et al. 2018, figure 1, at columns across the object.
void spoil(Sinogram& s, const Spoil& column) {
  std::mt19937 random(11);
  for (const std::int64_t c : {62, 97, 131, 158, 190, 224, 255}) column(s, c, random);
}

void full_stripe(Sinogram& s, std::int64_t c, std::mt19937& random) {
  const double offset = (random() % 2 == 0 ? 1 : -1) * (0.1 + 0.05 * static_cast<double>(random() % 5));
  for (std::int64_t k = 0; k < s.views; ++k) s.row(k)[c] += offset;
}
void partial_stripe(Sinogram& s, std::int64_t c, std::mt19937& random) {
  const auto first = static_cast<std::int64_t>(random() % 120);
  for (std::int64_t k = first; k < first + 200; ++k) s.row(k)[c] += 0.25;
}
void dead_stripe(Sinogram& s, std::int64_t c, std::mt19937& random) {
  const double value = 1 + 0.1 * static_cast<double>(random() % 10);
  for (std::int64_t k = 0; k < s.views; ++k) s.row(k)[c] = value;
}
void fluctuating_stripe(Sinogram& s, std::int64_t c, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 0.5);
  for (std::int64_t k = 0; k < s.views; ++k) s.row(k)[c] += noise(random);
}

// A scintillator's flaw: seven columns.
void large_stripe(Sinogram& s, std::int64_t c, std::mt19937& random) {
  const double offset = random() % 2 == 0 ? 1 : -1;
  for (std::int64_t k = 0; k < s.views; ++k)
    for (std::int64_t d = -3; d <= 3; ++d) s.row(k)[c + d] += offset;
}

double energy_of_difference(const Sinogram& a, const Sinogram& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += (a.data[i] - b.data[i]) * (a.data[i] - b.data[i]);
  return sum;
}

double spread(const Sinogram& s) {
  double mean = 0, sum = 0;
  for (const double p : s.data) mean += p / static_cast<double>(s.data.size());
  for (const double p : s.data) sum += (p - mean) * (p - mean);
  return sum;
}

Sinogram without_stripes(Sinogram s) {
  remove_dead_stripes(s, 3, 51);
  remove_lasting_stripes(s, 3, 21);
  remove_small_stripes(s, 21);
  return s;
}

// What is left of the stripes' energy: the result with stripes against that without.
double share_left(const Spoil& column) {
  const Sinogram clean = clean_sinogram();
  Sinogram spoilt = clean;
  spoil(spoilt, column);
  const double before = energy_of_difference(spoilt, clean);
  return energy_of_difference(without_stripes(spoilt), without_stripes(clean)) / before;
}

// What issue and paper ask: at least nine tenths of a stripe's energy go, and at most a fiftieth of the
// variance of a sinogram without any.
constexpr double most_left = 0.1, most_changed = 0.02;

}  // namespace

BOOST_AUTO_TEST_CASE(sinogram_without_stripes_is_hardly_changed) {
  const Sinogram clean = clean_sinogram();
  const double share = energy_of_difference(without_stripes(clean), clean) / spread(clean);
  BOOST_TEST_MESSAGE("changed by " << share << " of its variance");
  BOOST_TEST(share <= most_changed);
}

// Noise-free data without stripes: medians and quartiles of what tells stripes are about 0 there.
BOOST_AUTO_TEST_CASE(clean_slices_change_by_less_than_half_a_percent) {
  // X, Y, Z, radius and density, as shares of half the detector's width.
  struct Ball {
    double x, y, z, radius, density;
  };
  const std::vector<std::vector<Ball>> objects{{{0.1, -0.05, 0, 0.6, 1},
                                                {0.35, 0.1, 0.15, 0.14, 1.5},
                                                {-0.25, 0.3, -0.1, 0.1, -0.6},
                                                {-0.1, -0.4, 0.25, 0.12, 0.9}},
                                               {{0, 0, 0, 0.6, 1}},
                                               {{0.01, 0, 0, 0.6, 1}},
                                               {{0.05, 0.02, 0, 0.5, 1}, {0.3, 0.3, 0, 0.02, 5}}};
  // As docs/preparation.md says: of a slice's range, root mean square.
  constexpr double most = 0.005;
  for (const auto& [views, columns] : {std::pair<std::int64_t, std::int64_t>{120, 65}, {180, 129}, {60, 101}})
    for (std::size_t o = 0; o < objects.size(); ++o)
      for (const double height : {-0.06, 0.0, 0.06}) {
        ProjectionSet scan = vdvr::testing::empty_scan(views, 1, columns);
        const double half = 0.5 * static_cast<double>(columns - 1);
        for (std::int64_t k = 0; k < views; ++k) {
          const double theta = scan.geometry.theta_rad[static_cast<std::size_t>(k)];
          for (std::int64_t i = 0; i < columns; ++i) {
            double sum = 0;
            for (const Ball& b : objects[o]) {
              const double u =
                  static_cast<double>(i) / half - 1 - b.x * std::cos(theta) - b.y * std::sin(theta);
              sum += 2 * b.density *
                     std::sqrt(std::max(0.0, b.radius * b.radius - u * u - (height - b.z) * (height - b.z)));
            }
            scan.data[static_cast<std::size_t>(k * columns + i)] = static_cast<float>(0.03 * sum);
          }
        }
        Sinogram before{views, columns, std::vector<double>(scan.data.begin(), scan.data.end())};
        Preparation windows;
        windows.stripes.emplace();
        const Stripes used = *for_columns(windows, columns).stripes;
        Sinogram after = before;
        remove_dead_stripes(after, used.ratio, used.large);
        remove_lasting_stripes(after, used.ratio, used.small);
        remove_small_stripes(after, used.small);
        ProjectionSet changed = scan;
        for (std::size_t i = 0; i < after.data.size(); ++i)
          changed.data[i] = static_cast<float>(after.data[i]);
        std::vector<Vec3> points;
        for (double y = -0.9; y <= 0.9; y += 0.06)
          for (double x = -0.9; x <= 0.9; x += 0.06)
            if (x * x + y * y <= 0.81) points.push_back({x * half, y * half, 0});
        const std::vector<double> f = ExactField(scan, {}).at(points), g = ExactField(changed, {}).at(points);
        const auto [low, high] = std::minmax_element(f.begin(), f.end());
        double squares = 0;
        for (std::size_t i = 0; i < f.size(); ++i) squares += (g[i] - f[i]) * (g[i] - f[i]);
        const double share = std::sqrt(squares / static_cast<double>(f.size())) / (*high - *low);
        BOOST_TEST_MESSAGE(views << " views, " << columns << " columns, object " << o << ": " << share);
        BOOST_TEST(share <= most);
      }
}

BOOST_AUTO_TEST_CASE(each_kind_of_stripe_is_removed) {
  const std::vector<std::pair<const char*, Spoil>> kinds{{"full", full_stripe},
                                                         {"partial", partial_stripe},
                                                         {"large", large_stripe},
                                                         {"dead", dead_stripe},
                                                         {"fluctuating", fluctuating_stripe}};
  for (const auto& [name, kind] : kinds) BOOST_TEST_CONTEXT(name) {
      const double left = share_left(kind);
      BOOST_TEST_MESSAGE(name << ": " << left << " of the energy is left");
      BOOST_TEST(left <= most_left);
    }
}

// At the detector's edge there are neighbours on one side only.
BOOST_AUTO_TEST_CASE(dead_columns_at_the_edge_are_found) {
  Sinogram s = clean_sinogram();
  std::mt19937 random(1);
  dead_stripe(s, 0, random);
  dead_stripe(s, s.columns - 1, random);
  dead_stripe(s, s.columns - 2, random);
  BOOST_TEST(remove_dead_stripes(s, 3, 51) == 3);
}

BOOST_AUTO_TEST_CASE(all_kinds_together_are_removed) {
  const double left = share_left([](Sinogram& s, std::int64_t c, std::mt19937& random) {
    const std::array<Spoil, 4> kinds{full_stripe, partial_stripe, dead_stripe, fluctuating_stripe};
    kinds[static_cast<std::size_t>(c) % 4](s, c, random);
  });
  BOOST_TEST_MESSAGE("all: " << left << " of the energy is left");
  BOOST_TEST(left <= most_left);
}

BOOST_AUTO_TEST_CASE(values_on_a_line_do_not_stand_out_and_one_beside_it_does) {
  std::vector<double> values;
  for (int i = 0; i < 40; ++i) values.push_back(0.01 * ((7 * i) % 40));
  for (const bool mark : outstanding(values, 3, 1)) BOOST_TEST(!mark);
  values[13] = 5;
  const auto marks = outstanding(values, 3, 1);
  for (std::size_t i = 0; i < marks.size(); ++i) BOOST_TEST(marks[i] == (i == 13));
}

BOOST_AUTO_TEST_CASE(sinograms_too_small_to_judge_and_constant_ones_stay_finite) {
  for (const auto& [views, columns] :
       {std::pair<std::int64_t, std::int64_t>{1, 1}, {1, 5}, {40, 9}, {3, 200}}) {
    Sinogram s{views, columns, std::vector<double>(static_cast<std::size_t>(views * columns), 1.5)};
    const Sinogram before = s;
    s = without_stripes(std::move(s));
    BOOST_TEST(s.data == before.data, boost::test_tools::per_element());
  }
}
