// Photons from repeated flats and darks.
#define BOOST_TEST_MODULE photon_transfer
#include "host/scan/photon_transfer.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>

#include "tests/support/scans.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t rows = 40, columns = 50;

struct Camera {
  double photons = 5000, gain = 1, offset = 100, read = 0, drift = 0;
};

io::Frames frames_of(std::vector<std::vector<double>> frames) {
  io::Frames out;
  out.count = std::ssize(frames);
  out.read = [frames](std::int64_t first, std::int64_t n, double* to) {
    for (std::int64_t k = 0; k < n; ++k)
      to = std::copy(frames[static_cast<std::size_t>(first + k)].begin(),
                     frames[static_cast<std::size_t>(first + k)].end(), to);
  };
  out.name = [](std::int64_t) { return "frame"; };
  return out;
}

// Pixels see from half to one and a half of the photons; each frame's level drifts.
io::Frames frames_of(const Camera& camera, int n, bool open, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<std::vector<double>> frames;
  for (int k = 0; k < n; ++k) {
    std::vector<double> frame;
    const double level = 1 + camera.drift * (k - 0.5 * (n - 1));
    for (std::int64_t i = 0; i < rows * columns; ++i) {
      const double seen = camera.photons * level * (0.5 + static_cast<double>(i % columns) / (columns - 1));
      double counts = camera.offset;
      if (open) counts += camera.gain * static_cast<double>(std::poisson_distribution<long>(seen)(random));
      if (camera.read > 0) counts += std::normal_distribution<double>(0, camera.read)(random);
      frame.push_back(counts);
    }
    frames.push_back(std::move(frame));
  }
  return frames_of(std::move(frames));
}

}  // namespace

BOOST_AUTO_TEST_CASE(flats_tell_photons_gain_and_read_noise) {
  // 2000 pixels of n flats: the median of as many variances is good to sqrt(pi / 2) sqrt(2 / (n - 1) / 2000),
  // 2 % for 10; what is promised is 5 %.
  constexpr double promised = 0.05;
  for (const Camera& camera :
       {Camera{}, Camera{500, 0.7}, Camera{200000, 0.1, 20, 3}, Camera{3000, 2, 100, 5, 0.02}}) {
    const auto noise =
        photon_transfer(frames_of(camera, 10, true, 1), frames_of(camera, 10, false, 2), rows, columns);
    BOOST_TEST_REQUIRE(noise.has_value());
    BOOST_TEST(std::abs(noise->photons / camera.photons - 1) <= promised);
    // By pixel: the first sees half of the photons.
    BOOST_TEST(std::abs(static_cast<double>(noise->photon[0]) * camera.photons * 0.5 - 1) <= 3 * promised);
    const double open = camera.gain * camera.photons * 0.5,
                 read = static_cast<double>(noise->read[0]) * open * open;
    BOOST_TEST(std::abs(read - camera.read * camera.read) <= 3 * promised * camera.read * camera.read);
  }
}

// Between two runs the beam's profile turned around: within them it did not.
BOOST_AUTO_TEST_CASE(drift_between_runs_is_no_noise) {
  Camera camera;
  camera.offset = 0;
  std::vector<std::vector<double>> frames;
  std::mt19937_64 random(5);
  for (int k = 0; k < 20; ++k) {
    std::vector<double> frame;
    for (std::int64_t i = 0; i < rows * columns; ++i) {
      const double across = static_cast<double>(i % columns) / (columns - 1), tilt = k < 10 ? 0.1 : -0.1;
      const double seen = camera.photons * (1 + tilt * (2 * across - 1));
      frame.push_back(camera.gain * static_cast<double>(std::poisson_distribution<long>(seen)(random)));
    }
    frames.push_back(std::move(frame));
  }
  std::vector<std::vector<std::int64_t>> runs(2);
  for (std::int64_t k = 0; k < 20; ++k) runs[k < 10 ? 0 : 1].push_back(k);
  const io::Frames flats = frames_of(frames), none{};
  const auto within = photon_transfer(flats, none, rows, columns, runs);
  BOOST_TEST_REQUIRE(within.has_value());
  BOOST_TEST(std::abs(within->photons / camera.photons - 1) <= 0.05);
  // Taken as one run it is noise, and far more of it: the test could fail.
  const auto as_one = photon_transfer(flats, none, rows, columns);
  BOOST_TEST_REQUIRE(as_one.has_value());
  BOOST_TEST(as_one->photons < 0.7 * camera.photons);
}

BOOST_AUTO_TEST_CASE(flats_that_tell_nothing_are_said_to) {
  const Camera camera;
  BOOST_TEST(!photon_transfer(frames_of(camera, 4, true, 1), frames_of(camera, 4, false, 2), rows, columns));
  // Saturated, or one flat written ten times.
  Camera still;
  still.gain = 0;
  still.offset = 65535;
  Camera dark;
  dark.offset = 0;
  BOOST_TEST(!photon_transfer(frames_of(still, 10, true, 1), frames_of(dark, 10, false, 2), rows, columns));
}

BOOST_AUTO_TEST_CASE(means_of_pixels_have_the_noise_of_means) {
  LineIntegralNoise noise;
  noise.photons = 100;
  noise.photon = {0.01f, 0.02f, 0.03f, 0.04f};
  noise.read = {4e-4f};
  noise.constant = 8;
  const LineIntegralNoise of_mean = binned(noise, 2, 2, 2);
  BOOST_TEST(of_mean.photons == 400);
  BOOST_TEST_REQUIRE(of_mean.photon.size() == 1u);
  BOOST_TEST(of_mean.photon[0] == 0.1f / 16, boost::test_tools::tolerance(0x1p-22f));
  BOOST_TEST(of_mean.read[0] == 1e-4f);
  BOOST_TEST(of_mean.constant == 2);
}

BOOST_AUTO_TEST_CASE(counts_that_are_written_are_read_as_the_line_integrals_they_are) {
  const support::TemporaryFolder folder;
  const ProjectionSet ideal = testing::simulated(sphere(10, 0.1), 33, 20, 12);
  for (const double photons : {2000.0, 1e6}) {
    const auto path = folder / "counts.h5";
    write_photon_counts(path, ideal, {.photons = photons, .seed = 4});
    const ProjectionSet scan = read_scan(path);
    BOOST_TEST_REQUIRE(scan.data.size() == ideal.data.size());
    BOOST_TEST(scan.geometry.pitch_u == ideal.geometry.pitch_u);
    const auto noise = read_line_noise(path);
    BOOST_TEST_REQUIRE(noise.has_value());
    BOOST_TEST(std::abs(noise->photons / photons - 1) <= 0.1);
    // Each within six of its own standard deviations, flats' included.
    double squares = 0;
    for (std::size_t i = 0; i < scan.data.size(); ++i) {
      const double p = static_cast<double>(ideal.data[i]), v = std::exp(p) / photons + 0.1 / photons,
                   off = static_cast<double>(scan.data[i]) - p;
      BOOST_TEST(off * off <= 36 * v);
      squares += off * off / v / static_cast<double>(scan.data.size());
    }
    // A mean of n squares is good to sqrt(2 / n); flats are common to the views.
    BOOST_TEST(std::abs(squares - 1) <= 4 * std::sqrt(2 / (20.0 * 33)));
    // The same photons from the same seed.
    write_photon_counts(folder / "again.h5", ideal, {.photons = photons, .seed = 4});
    BOOST_TEST((read_scan(folder / "again.h5").data == scan.data));
  }
  BOOST_CHECK_THROW(write_photon_counts(folder / "none.h5", ideal, {.photons = 0.5}), InputError);
  BOOST_TEST(!std::filesystem::exists(folder / "none.h5"));
}
