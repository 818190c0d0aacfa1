// Flats taken at several places, and the beam's current: gains by hand, and what is refused.
#define BOOST_TEST_MODULE flats_in_time
#include "host/scan/flats_in_time.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>

#include "host/base/system/casts.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t size = 3;  // one row

// Frames whose pixel i is values[frame] * (i + 1) + dark.
io::Frames frames_of(std::vector<double> values, double dark) {
  io::Frames frames;
  frames.count = std::ssize(values);
  frames.name = [](std::int64_t k) { return "frame " + std::to_string(k); };
  frames.read = [values, dark](std::int64_t first, std::int64_t n, double* out) {
    for (std::int64_t k = 0; k < n; ++k)
      for (std::int64_t i = 0; i < size; ++i)
        out[k * size + i] = values[at(first + k)] * static_cast<double>(i + 1) + dark;
  };
  return frames;
}

// Flats of 100 at places 0 and 1, of 130 at place 7, of 90 at 12; projections between.
io::RawScan raw_scan() {
  io::RawScan raw;
  raw.rows = 1;
  raw.columns = size;
  raw.flats = frames_of({100, 100, 130, 90}, 5);
  raw.projections = frames_of(std::vector<double>(9, 50), 5);
  raw.beam_in_time.flats_at = {0, 1, 7, 12};
  raw.beam_in_time.projections_at = {2, 3, 4, 5, 6, 8, 9, 10, 11};
  return raw;
}

const std::vector<double> dark(size, 5.0);

double gain(FlatsInTime& in_time, std::int64_t view, std::int64_t pixel) {
  in_time.go_to(view, 1, dark);
  return in_time.gain(view)[at(pixel)];
}

std::string refusal(const io::RawScan& raw, const Preparation& wanted) {
  try {
    const FlatsInTime in_time(raw, wanted);
  } catch (const InputError& e) {
    return e.what();
  }
  return {};
}

void same(double found, double wanted) {
  BOOST_TEST(std::abs(found - wanted) <= tolerance::fp64_sum(16, std::abs(wanted)));
}

}  // namespace

BOOST_AUTO_TEST_CASE(gains_lie_between_the_runs_around_a_projection) {
  const io::RawScan raw = raw_scan();
  FlatsInTime in_time(raw, {});
  BOOST_TEST(!in_time.none());
  // Runs at 0.5, 7 and 12.
  same(gain(in_time, 0, 0), 100 + 30 * (2 - 0.5) / 6.5);
  same(gain(in_time, 4, 2), 3 * (100 + 30 * (6 - 0.5) / 6.5));
  same(gain(in_time, 5, 1), 2 * (130 - 40 * (8 - 7) / 5.0));
  Preparation recorded;
  BOOST_TEST(in_time.record(recorded).size() == 1u);
  BOOST_TEST((recorded.flats_in_time == true && !recorded.beam_current));
}

BOOST_AUTO_TEST_CASE(before_the_first_and_after_the_last_run_gains_are_theirs) {
  io::RawScan raw = raw_scan();
  raw.beam_in_time.projections_at = {-3, 2, 3, 4, 5, 6, 8, 9, 20};
  FlatsInTime in_time(raw, {});
  same(gain(in_time, 0, 0), 100);
  same(gain(in_time, 8, 0), 90);
}

BOOST_AUTO_TEST_CASE(one_run_and_an_unknown_order_are_left_to_the_mean) {
  io::RawScan raw = raw_scan();
  raw.beam_in_time.flats_at = {0, 0.25, 0.5, 1};
  BOOST_TEST(FlatsInTime(raw, {}).none());
  raw.beam_in_time = {};
  BOOST_TEST(FlatsInTime(raw, {}).none());
  Preparation off;
  off.flats_in_time = false;
  BOOST_TEST(FlatsInTime(raw_scan(), off).none());
  Preparation recorded;
  BOOST_TEST(FlatsInTime(raw, {}).record(recorded).empty());
  BOOST_TEST((recorded == Preparation{}));
}

BOOST_AUTO_TEST_CASE(currents_leave_the_transmission) {
  // The beam fell; without order there is one run of all flats.
  io::RawScan raw = raw_scan();
  raw.beam_in_time = {};
  raw.flats = frames_of({100, 80, 60, 40}, 5);
  raw.beam_in_time.flat_currents = {10, 8, 6, 4};
  for (int k = 0; k < 9; ++k) raw.beam_in_time.projection_currents.push_back(10 - k);
  FlatsInTime in_time(raw, {});
  for (std::int64_t k = 0; k < 9; ++k) same(gain(in_time, k, 1), 2 * 10 * static_cast<double>(10 - k));
  Preparation recorded;
  BOOST_TEST(in_time.record(recorded).size() == 1u);
  BOOST_TEST((recorded.beam_current == true && !recorded.flats_in_time));
  Preparation off;
  off.beam_current = false;
  BOOST_TEST(FlatsInTime(raw, off).none());
}

BOOST_AUTO_TEST_CASE(a_pixel_that_is_dead_in_one_run_is_dead_between) {
  io::RawScan raw = raw_scan();
  raw.flats = frames_of({100, 100, -1, 90}, 5);
  FlatsInTime in_time(raw, {});
  BOOST_TEST(std::isnan(gain(in_time, 2, 0)));
  raw.flats = frames_of({100, 100, 130, 90}, 5);
  FlatsInTime sound(raw, {});
  BOOST_TEST(std::isfinite(gain(sound, 2, 0)));
}

BOOST_AUTO_TEST_CASE(what_the_scan_does_not_tell_is_refused) {
  Preparation time, current;
  time.flats_in_time = true;
  current.beam_current = true;
  io::RawScan raw = raw_scan();
  raw.beam_in_time = {};
  BOOST_TEST(refusal(raw, time).find("flats_at") != std::string::npos);
  BOOST_TEST(refusal(raw, current).find("beam_current") != std::string::npos);
  raw.beam_in_time.currents = "/entry/control/data";
  raw.beam_in_time.flat_currents = {1, 1, 1, 1};
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    raw.beam_in_time.projection_currents = std::vector<double>(9, 1.0);
    raw.beam_in_time.projection_currents[4] = bad;
    const std::string text = refusal(raw, {});
    BOOST_TEST(text.find("/entry/control/data") == 0u);
    BOOST_TEST(text.find("projection 4") != std::string::npos);
  }
}
