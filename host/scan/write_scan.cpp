// Scans written as Data Exchange: line integrals, or the photons that a detector counts of them. Declared in
// vdvr/read_scan.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/random/poisson_distribution.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <span>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/files/hdf5/hdf5_writer.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

constexpr const char* kData = "/exchange/data";
// One chunk per view, cut into rows where a chunk would pass HDF5's 4 GiB.
constexpr std::int64_t chunk_samples = std::int64_t{1} << 26;

void require_samples(const fs::path& path, const ProjectionSet& scan) {
  const ParallelGeometry& g = scan.geometry;
  const std::array<std::int64_t, 3> shape{g.views(), g.rows, g.columns};
  if (std::any_of(shape.begin(), shape.end(), [](std::int64_t n) { return n < 1; }) ||
      static_cast<std::int64_t>(scan.data.size()) != scan.size())
    throw InputError(fmt::format("{}: {} samples for {} projections", path.string(), scan.data.size(),
                                 io::shape_text(shape)));
}

void require_no_series(const fs::path& path, const ParallelGeometry& g) {
  if (!g.series.none())
    throw InputError(path.string() +
                     ": rows of a series of heights are weighted by height, which no file says; write the "
                     "projections as they were measured");
}

// What says where the samples of /exchange/data lie.
void write_geometry(io::hdf5::Writer& file, const ParallelGeometry& g) {
  file.attribute(kData, "axes", "theta:y:x");
  file.attribute(kData, "unit", g.unit);
  file.attribute(kData, "pitch_u", g.pitch_u);
  file.attribute(kData, "pitch_v", g.pitch_v);
  file.attribute(kData, "center", g.center);
  // Of rows that were brought upright, or to common heights, what is left.
  const bool rows_moved = !g.row_shift.empty() && !g.extension.common_heights;
  if (g.axis_roll_deg != 0 && !g.extension.common_heights)
    file.attribute(kData, "axis_roll", g.axis_roll_deg);
  if (!g.column_shift.empty() || rows_moved) {
    std::vector<double> shifts;  // [view][column, row], in the unit
    for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
      shifts.push_back(g.column_shift.empty() ? 0 : g.column_shift[k] * g.pitch_u);
      shifts.push_back(rows_moved ? g.row_shift[k] * g.pitch_v : 0);
    }
    file.dataset("/exchange/shifts", {g.theta_rad.size(), 2}, std::span<const double>(shifts),
                 {g.theta_rad.size(), 2});
  }
  std::vector<double> theta_deg;
  for (const double t : g.theta_rad) theta_deg.push_back(t * (180 / std::numbers::pi));
  file.dataset("/exchange/theta", {theta_deg.size()}, std::span<const double>(theta_deg), {theta_deg.size()});
  file.attribute("/exchange/theta", "units", "degrees");
}

// Frames of one kind; each has a stream of random numbers of its own.
template <class Count>
class Counter {
 public:
  Counter(io::hdf5::Writer& file, const ParallelGeometry& g, const PhotonCounts& counts)
      : file_(file), g_(g), counts_(counts) {}

  // `open(frame, pixel)`: photons expected.
  template <class Open>
  void write(const std::string& dataset, std::int64_t frames, std::uint32_t kind, const Open& open) {
    const std::int64_t rows = std::clamp<std::int64_t>(chunk_samples / g_.columns, 1, g_.rows);
    const auto out =
        file_.chunked_dataset(dataset, {count(frames), count(g_.rows), count(g_.columns)},
                              {1, count(rows), count(g_.columns)}, io::hdf5::element_type<Count>(), 0);
    std::vector<Count> chunk(at(rows * g_.columns));
    for (std::int64_t k = 0; k < frames; ++k) {
      std::seed_seq words{static_cast<std::uint32_t>(counts_.seed),
                          static_cast<std::uint32_t>(counts_.seed >> 32), kind,
                          static_cast<std::uint32_t>(k)};
      std::mt19937_64 random(words);
      for (std::int64_t v = 0; v < g_.rows; v += rows) {
        std::fill(chunk.begin(), chunk.end(), Count{0});
        const std::int64_t pixels = std::min(rows, g_.rows - v) * g_.columns;
        for (std::int64_t i = 0; i < pixels; ++i) chunk[at(i)] = drawn(open(k, v * g_.columns + i), random);
        file_.chunk(out, {count(k), count(v), 0}, std::as_bytes(std::span(chunk)));
      }
    }
  }

 private:
  Count drawn(double expected, std::mt19937_64& random) const {
    double photons = 0;
    if (expected > 0)
      photons = static_cast<double>(boost::random::poisson_distribution<std::int64_t>(expected)(random));
    return static_cast<Count>(
        std::min(counts_.offset + photons, static_cast<double>(std::numeric_limits<Count>::max())));
  }

  io::hdf5::Writer& file_;
  const ParallelGeometry& g_;
  const PhotonCounts& counts_;
};

// Places of frames in time, and the beam then.
class Timeline {
 public:
  Timeline(const ParallelGeometry& g, const PhotonCounts& counts) : g_(g), counts_(counts) {
    for (std::int64_t r = 0; r < counts.flat_runs; ++r) {
      const double share =
          counts.flat_runs == 1 ? 0 : static_cast<double>(r) / static_cast<double>(counts.flat_runs - 1);
      const auto before = static_cast<std::int64_t>(std::round(share * static_cast<double>(g.views())));
      for (std::int64_t f = 0; f < counts.flats; ++f) flats_after_.push_back(before);
    }
  }
  [[nodiscard]] std::int64_t flats() const { return std::ssize(flats_after_); }
  [[nodiscard]] std::vector<double> flats_after() const { return {flats_after_.begin(), flats_after_.end()}; }
  // From 0 in the first to 1 in the last frame.
  [[nodiscard]] double of_projection(std::int64_t k) const {
    const auto before = std::upper_bound(flats_after_.begin(), flats_after_.end(), k) - flats_after_.begin();
    return share(k + before);
  }
  [[nodiscard]] double of_flat(std::int64_t f) const { return share(flats_after_[at(f)] + f); }
  [[nodiscard]] double current(double time) const { return 1 - counts_.beam_decay * time; }
  // Photons expected in a pixel of the open beam.
  [[nodiscard]] double open(double time, std::int64_t pixel) const {
    if (counts_.flat_drift == 0 && counts_.beam_decay == 0) return counts_.photons;
    const double x = 2 * static_cast<double>(pixel % g_.columns) /
                         static_cast<double>(std::max<std::int64_t>(1, g_.columns - 1)) -
                     1;
    return counts_.photons * current(time) * (1 + counts_.flat_drift * time * x);
  }

 private:
  [[nodiscard]] double share(std::int64_t frame) const {
    return static_cast<double>(frame) /
           static_cast<double>(std::max<std::int64_t>(1, g_.views() + flats() - 1));
  }
  const ParallelGeometry& g_;
  const PhotonCounts& counts_;
  std::vector<std::int64_t> flats_after_;  // by how many projections
};

void write_timeline(io::hdf5::Writer& file, const ParallelGeometry& g, const PhotonCounts& counts,
                    const Timeline& time) {
  if (counts.flat_runs > 1) {
    const std::vector<double> places = time.flats_after();
    file.dataset("/exchange/data_white_at", {places.size()}, std::span<const double>(places),
                 {places.size()});
  }
  if (counts.beam_decay == 0) return;
  std::vector<double> currents;
  for (std::int64_t k = 0; k < g.views(); ++k) currents.push_back(time.current(time.of_projection(k)));
  for (std::int64_t f = 0; f < time.flats(); ++f) currents.push_back(time.current(time.of_flat(f)));
  file.dataset("/exchange/beam_current", {currents.size()}, std::span<const double>(currents),
               {currents.size()});
}

template <class Count>
void write_counts(io::hdf5::Writer& file, const ProjectionSet& scan, const PhotonCounts& counts) {
  const ParallelGeometry& g = scan.geometry;
  Counter<Count> counter(file, g, counts);
  const Timeline time(g, counts);
  counter.write(kData, g.views(), 0, [&](std::int64_t k, std::int64_t pixel) {
    return time.open(time.of_projection(k), pixel) *
           std::exp(-static_cast<double>(scan.data[at(k * g.rows * g.columns + pixel)]));
  });
  counter.write("/exchange/data_white", time.flats(), 1,
                [&](std::int64_t f, std::int64_t pixel) { return time.open(time.of_flat(f), pixel); });
  counter.write("/exchange/data_dark", counts.darks, 2, [](std::int64_t, std::int64_t) { return 0.0; });
  write_timeline(file, g, counts, time);
}

}  // namespace

void write_data_exchange(const fs::path& path, const ProjectionSet& scan) {
  require_samples(path, scan);
  require_no_series(path, scan.geometry);
  const ParallelGeometry& g = scan.geometry;
  io::AtomicFile target(path);
  io::hdf5::Writer file(target.temporary(), path, {.headers = io::hdf5::Headers::dated});
  file.group("/exchange");
  file.dataset(kData, {count(g.views()), count(g.rows), count(g.columns)}, std::span<const float>(scan.data),
               {1, count(std::clamp<std::int64_t>(chunk_samples / g.columns, 1, g.rows)), count(g.columns)});
  file.attribute(kData, "description", "line integrals");
  write_geometry(file, g);
  file.close();
  target.commit();
}

void write_photon_counts(const fs::path& path, const ProjectionSet& scan, const PhotonCounts& counts) {
  require_samples(path, scan);
  require_no_series(path, scan.geometry);
  constexpr double most_photons = 1e9;
  if (!(counts.photons >= 1 && counts.photons <= most_photons))
    throw InputError(
        fmt::format("{}: {} photons a pixel; give 1 to {:.0e}", path.string(), counts.photons, most_photons));
  if (counts.flats < 1 || counts.darks < 1 || counts.offset < 0)
    throw InputError(fmt::format(
        "{}: {} flats, {} darks, offset {}: counts need a flat, a dark, and an offset of 0 or more",
        path.string(), counts.flats, counts.darks, counts.offset));
  if (counts.flat_runs < 1 || counts.flat_runs > scan.geometry.views() + 1)
    throw InputError(fmt::format("{}: {} runs of flats; give 1 to {}, one more than views", path.string(),
                                 counts.flat_runs, scan.geometry.views() + 1));
  for (const double share : {counts.flat_drift, counts.beam_decay})
    if (!(std::abs(share) < 1))
      throw InputError(fmt::format("{}: the open beam changes by a share of {}; it must be below 1",
                                   path.string(), share));
  io::AtomicFile target(path);
  io::hdf5::Writer file(target.temporary(), path, {.headers = io::hdf5::Headers::dated});
  file.group("/exchange");
  // Six standard deviations above the open beam.
  const double open = counts.photons * (1 + std::abs(counts.flat_drift)) *
                      (1 + std::max(0.0, -counts.beam_decay)),
               largest = counts.offset + open + 6 * std::sqrt(open);
  if (largest < static_cast<double>(std::numeric_limits<std::uint16_t>::max()))
    write_counts<std::uint16_t>(file, scan, counts);
  else write_counts<std::uint32_t>(file, scan, counts);
  write_geometry(file, scan.geometry);
  file.close();
  target.commit();
}

}  // namespace vdvr
