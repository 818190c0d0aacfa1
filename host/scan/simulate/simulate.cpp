// Projections of a phantom: line integrals at pixel centres, or 16 per pixel low-passed at Nyquist
// (simulate_band_limit), then the detector's recipe (simulate_detector): noise, median, Gaussian, binning.
// Views are independent and spread over threads. float data[view][v][u].
#include "vdvr/expert/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <system_error>
#include <thread>

#include "host/scan/raw/raster_scan.hpp"
#include "host/scan/raw/raw_scan.hpp"
#include "host/scan/simulate/simulate_band_limit.hpp"
#include "host/scan/simulate/simulate_cone.hpp"
#include "host/scan/simulate/simulate_detector.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"

namespace vdvr {
namespace {

// Line integrals of a block of rows are held in double at once; larger blocks share more between rows.
constexpr std::int64_t block_samples = std::int64_t{1} << 19;

void check(const Phantom& phantom, const SimulateOptions& o) {
  const auto refuse = [](const char* name, auto value, const char* remedy) {
    throw InputError(fmt::format("simulate: {} {} is not usable; give {}", name, value, remedy));
  };
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  const auto not_negative = [](double x) { return std::isfinite(x) && x >= 0; };
  if (!phantom.line_integral && !phantom.view_integrals)
    throw InputError(fmt::format("simulate: phantom \"{}\" has no line integrals", phantom.name));
  if (phantom.background != 0)
    throw InputError(
        fmt::format("simulate: phantom \"{}\" has the background {}, whose line integrals are infinite; set "
                    "\"background\" to 0 and add an ellipsoid of that density as large as the object",
                    phantom.name, phantom.background));
  if (o.cone) check_cone(phantom, *o.cone);
  if (o.angles < 1) refuse("angles", o.angles, "at least 1");
  const double most_arc = o.cone ? 360 : 360'000;  // of turns at several heights
  if (!positive(o.arc_deg) || o.arc_deg > most_arc)
    refuse("arc", o.arc_deg,
           o.cone ? "degrees above 0, up to 360" : "degrees above 0, up to a thousand turns");
  if (o.columns < 1 || o.rows < 1)
    refuse("detector", fmt::format("{}x{}", o.columns, o.rows), "at least 1x1");
  if (!positive(o.pitch_u)) refuse("pitch in u", o.pitch_u, "a positive length");
  if (!positive(o.pitch_v)) refuse("pitch in v", o.pitch_v, "a positive length");
  if (!(std::abs(o.detector_offset) < 0.5 * static_cast<double>(o.columns)))
    refuse("detector-offset", o.detector_offset, "columns that leave the axis on the detector");
  if (!o.shifts.empty() && (o.cone || std::ssize(o.shifts) != o.angles))
    refuse("shifts of so many views:", o.shifts.size(), "one for each view of parallel beam");
  for (const auto& shift : o.shifts)
    for (const double s : shift)
      if (!std::isfinite(s)) refuse("shift", s, "a finite length");
  require_axis_roll(o.axis_roll_deg, "simulate");
  if (o.axis_roll_deg != 0 && o.cone)
    throw InputError("simulate: an axis' roll is of parallel beam; a cone has its own tilts");
  if (o.axis_roll_deg != 0 && !phantom.line_integral)
    throw InputError(fmt::format(
        "simulate: phantom \"{}\" has no line integrals of single rays, which a roll needs", phantom.name));
  if (!not_negative(o.noise_sigma))
    refuse("noise-sigma", o.noise_sigma, "0 or a fraction of the largest line integral");
  if (o.median < 0 || (o.median > 0 && o.median % 2 == 0))
    refuse("median", o.median, "an odd side, or 0 for none");
  if (!not_negative(o.gaussian_u))
    refuse("gaussian in u", o.gaussian_u, "0 or a standard deviation in fine pixels");
  if (!not_negative(o.gaussian_v))
    refuse("gaussian in v", o.gaussian_v, "0 or a standard deviation in fine pixels");
  if (o.binning < 1) refuse("binning", o.binning, "fine pixels per pixel, at least 1");
  const double largest = static_cast<double>(std::max(o.columns, o.rows)) * o.binning;
  if (o.median > largest) refuse("median", o.median, "a window no wider than the detector");
  if (std::max(o.gaussian_u, o.gaussian_v) > largest)
    refuse("gaussian", std::max(o.gaussian_u, o.gaussian_v),
           "a standard deviation no larger than the detector");
}

// The detector on which line integrals are taken: `binning` times finer, same outline.
struct FineDetector {
  std::int64_t columns, rows;
  double pitch_u, pitch_v;
  std::vector<double> u, v;  // of the line integrals: 16 per fine pixel in u where band-limited
};

FineDetector fine_detector(const SimulateOptions& o) {
  FineDetector d{
      o.columns * o.binning, o.rows * o.binning, o.pitch_u / o.binning, o.pitch_v / o.binning, {}, {}};
  const std::int64_t rate = o.band_limited ? BandLimiter::rate : 1;
  // Twice the distance from the detector's middle, in samples, is an integer: u is exactly antisymmetric.
  const auto positions = [](std::int64_t n, double spacing, double offset) {
    std::vector<double> x(static_cast<std::size_t>(n));
    for (std::int64_t i = 0; i < n; ++i)
      x[static_cast<std::size_t>(i)] = static_cast<double>(2 * i + 1 - n) / 2 * spacing + offset;
    return x;
  };
  d.u = positions(d.columns * rate, d.pitch_u / static_cast<double>(rate),
                  o.cone || o.axis_roll_deg != 0 ? 0.0 : o.detector_offset * o.pitch_u);
  d.v = positions(d.rows, d.pitch_v, 0);
  return d;
}

// Samples and bytes, checked in 64 bits before anything is allocated. A result in scratch takes its share.
void check_memory(const SimulateOptions& o, unsigned threads) {
  const auto limit = static_cast<double>(std::numeric_limits<std::int64_t>::max() / 1024);
  const double fine = static_cast<double>(o.columns) * o.binning * static_cast<double>(o.rows) * o.binning;
  const double result =
      static_cast<double>(o.angles) * static_cast<double>(o.columns) * static_cast<double>(o.rows) * 4;
  const double block =
      std::max(static_cast<double>(block_samples), static_cast<double>(o.columns) * o.binning * 16);
  const double share = static_cast<double>(o.max_memory_bytes / 8);
  const double bytes = (o.max_memory_bytes > 0 ? std::min(result, share) : result) +
                       threads * (fine * 8 * (o.median > 1 || o.gaussian_u > 0 || o.gaussian_v > 0 ? 3 : 2) +
                                  block * 8 + static_cast<double>(o.columns) * o.binning * 12 * 16);
  const bool over = o.max_memory_bytes > 0 && bytes > static_cast<double>(o.max_memory_bytes);
  if (over || !(bytes < limit) || !(result < limit))
    throw ResourceError(fmt::format(
        "simulate: {} views of {} x {} with binning {} need {:.1f} MiB on {} threads{}; use fewer "
        "views, a smaller detector or less binning",
        o.angles, o.columns, o.rows, o.binning, bytes / 0x1p20, threads,
        over ? fmt::format(", more than the limit of {:.1f} MiB",
                           static_cast<double>(o.max_memory_bytes) / 0x1p20)
             : ""));
}

// Work on views shared by threads: each takes the next view; only the calling thread reports; the first
// exception (an interrupt thrown by Progress among them) stops all and is thrown again once they have ended.
class ViewLoop {
 public:
  ViewLoop(std::int64_t views, unsigned threads)
      : views_(views), threads_(static_cast<unsigned>(std::min<std::int64_t>(threads, views))) {}
  [[nodiscard]] bool stopped() const { return stop_; }

  template <class Work, class Report>
  void run(const Work& work, const Report& report_done) {
    std::vector<std::thread> helpers;
    helpers.reserve(threads_);
    try {
      while (helpers.size() + 1 < threads_) helpers.emplace_back([&] { take_views(work, [](double) {}); });
    } catch (const std::system_error&) {
      // Too many threads for the system: fewer do the same work.
    }
    take_views(work, report_done);
    for (std::thread& helper : helpers) helper.join();
    if (failure_) std::rethrow_exception(failure_);
    report_done(1.0);
  }

 private:
  template <class Work, class Report>
  void take_views(const Work& work, const Report& report_done) {
    try {
      for (std::int64_t k = next_++; k < views_ && !stop_; k = next_++) {
        work(k, *this);
        report_done(static_cast<double>(++done_) / static_cast<double>(views_));
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      stop_ = true;
    }
  }

  std::int64_t views_;
  unsigned threads_;
  std::atomic<std::int64_t> next_{0}, done_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::exception_ptr failure_;
};

class Simulator {
 public:
  Simulator(const Phantom& phantom, const SimulateOptions& options, unsigned threads)
      : phantom_(phantom), options_(options), threads_(threads), detector_(fine_detector(options)) {
    if (options.band_limited) limiter_.emplace(detector_.columns);
    for (int k = 0; k < options.angles; ++k)
      theta_.push_back(k * options.arc_deg / options.angles * (std::numbers::pi / 180));
    truncated_.assign(theta_.size(), 0);
  }

  /// Largest |line integral| on the fine detector: what the noise is relative to.
  double largest(const Progress& progress) {
    std::vector<double> of_view(theta_.size());
    ViewLoop(options_.angles, threads_)
        .run(
            [&](std::int64_t k, const ViewLoop& loop) {
              double& top = of_view[static_cast<std::size_t>(k)];
              for (const double value : project(k, loop).data) top = std::max(top, std::abs(value));
            },
            [&](double done) { report(progress, "simulate", done / 2); });
    return *std::max_element(of_view.begin(), of_view.end());
  }

  static float in_float32(double value) {
    constexpr double most = static_cast<double>(std::numeric_limits<float>::max());
    if (!(std::abs(value) <= most))
      throw InputError(
          fmt::format("a line integral of {:.3g} does not fit float32, which ends at {:.3g}: lower the "
                      "phantom's densities, or state lengths in another unit",
                      value, most));
    return static_cast<float>(value);
  }

  void run(double noise, double from, const Progress& progress, std::span<float> data) {
    const auto size = static_cast<std::size_t>(options_.columns * options_.rows);
    ViewLoop(options_.angles, threads_)
        .run(
            [&](std::int64_t k, const ViewLoop& loop) {
              const View view = detected(project(k, loop), noise, k);
              std::transform(view.data.begin(), view.data.end(),
                             data.begin() + static_cast<std::ptrdiff_t>(size) * k, in_float32);
            },
            [&](double done) { report(progress, "simulate", from + (1 - from) * done); });
  }

  [[nodiscard]] const std::vector<double>& theta() const { return theta_; }
  [[nodiscard]] std::int64_t truncated_views() const {
    return std::count(truncated_.begin(), truncated_.end(), 1);
  }

 private:
  // A noise-free view on the fine detector, in blocks of rows. A stopped loop ends it early: its result is
  // not used.
  View project(std::int64_t k, const ViewLoop& loop) {
    const auto columns = static_cast<std::int64_t>(detector_.u.size());
    const std::int64_t step = std::clamp(block_samples / columns, std::int64_t{1}, detector_.rows);
    View view{detector_.columns, detector_.rows, {}};
    view.data.resize(static_cast<std::size_t>(view.columns * view.rows));
    std::vector<double> block;
    for (std::int64_t j = 0; j < detector_.rows && !loop.stopped(); j += step) {
      const auto rows = static_cast<std::size_t>(std::min(step, detector_.rows - j));
      block.resize(rows * detector_.u.size());
      integrate(k, std::span(detector_.v).subspan(static_cast<std::size_t>(j), rows), block);
      const std::span<double> target(&view.at(0, j), rows * static_cast<std::size_t>(view.columns));
      if (limiter_) limiter_->apply(block, target);
      else std::copy(block.begin(), block.end(), target.begin());
    }
    return view;
  }

  void integrate(std::int64_t k, std::span<const double> v, std::span<double> out) {
    const double theta = theta_[static_cast<std::size_t>(k)];
    const std::size_t n = detector_.u.size();
    if (options_.cone) {
      const ConeRays rays(phantom_, options_, static_cast<int>(k));
      for (std::size_t j = 0; j < v.size(); ++j)
        for (std::size_t i = 0; i < n; ++i) out[j * n + i] = rays(detector_.u[i], v[j]);
    } else {
      // A sample that stands farther towards higher columns is seen there.
      std::vector<double> us = detector_.u, vs{v.begin(), v.end()};
      if (!options_.shifts.empty()) {
        const auto [du, dv] = options_.shifts[static_cast<std::size_t>(k)];
        for (double& u : us) u -= du;
        for (double& height : vs) height -= dv;
      }
      if (options_.axis_roll_deg != 0) integrate_leaning(theta, us, vs, out);
      else if (phantom_.view_integrals) phantom_.view_integrals(theta, us, vs, out);
      else
        for (std::size_t j = 0; j < v.size(); ++j)
          for (std::size_t i = 0; i < n; ++i) out[j * n + i] = phantom_.line_integral(theta, us[i], vs[j]);
    }
    for (std::size_t j = 0; j < v.size(); ++j)
      if (out[j * n] != 0 || out[j * n + n - 1] != 0) truncated_[static_cast<std::size_t>(k)] = 1;
  }

  // Rays at distances t from the axis and heights z along it, of pixels that lie turned against both.
  void integrate_leaning(double theta, const std::vector<double>& us, const std::vector<double>& vs,
                         std::span<double> out) const {
    const double roll = options_.axis_roll_deg * (std::numbers::pi / 180), c = std::cos(roll),
                 s = std::sin(roll), offset = options_.detector_offset * options_.pitch_u;
    for (std::size_t j = 0; j < vs.size(); ++j)
      for (std::size_t i = 0; i < us.size(); ++i)
        out[j * us.size() + i] =
            phantom_.line_integral(theta, us[i] * c - vs[j] * s + offset, us[i] * s + vs[j] * c);
  }

  [[nodiscard]] View detected(View view, double noise, std::int64_t k) const {
    if (noise > 0) add_noise(view, noise, options_.seed, k);
    if (options_.median > 1) view = median_filtered(view, options_.median);
    if (options_.gaussian_u > 0 || options_.gaussian_v > 0)
      view = gaussian_filtered(view, options_.gaussian_u, options_.gaussian_v);
    return options_.binning > 1 ? binned(view, options_.binning) : view;
  }

  const Phantom& phantom_;
  const SimulateOptions& options_;
  unsigned threads_;
  FineDetector detector_;
  std::optional<BandLimiter> limiter_;
  std::vector<double> theta_;
  std::vector<char> truncated_;  // per view; char, not bool: written by several threads
};

// Everything the numbers follow from, in one canonical text.
std::string options_text(const Phantom& phantom, const SimulateOptions& o) {
  nlohmann::json text{{"phantom", phantom.description.empty() ? phantom.name : phantom.description},
                      {"angles", o.angles},
                      {"arc_deg", o.arc_deg},
                      {"columns", o.columns},
                      {"rows", o.rows},
                      {"pitch", {o.pitch_u, o.pitch_v}},
                      {"unit", o.unit},
                      {"band_limited", o.band_limited},
                      {"noise_sigma", o.noise_sigma},
                      {"seed", o.noise_sigma > 0 ? o.seed : 0},
                      {"median", std::max(o.median, 1)},
                      {"gaussian", {o.gaussian_u, o.gaussian_v}},
                      {"binning", o.binning}};
  if (o.detector_offset != 0) text["detector_offset"] = o.detector_offset;
  if (!o.shifts.empty()) text["shifts"] = o.shifts;
  if (o.axis_roll_deg != 0) text["axis_roll_deg"] = o.axis_roll_deg;
  if (o.cone)
    text["cone"] = {{"source_to_axis", o.cone->source_to_axis},
                    {"source_to_detector", o.cone->source_to_detector},
                    {"detector_offset", o.cone->detector_offset},
                    {"tilt_deg", {o.cone->in_plane_deg, o.cone->out_of_plane_deg}},
                    {"sense", o.cone->sense},
                    {"focal_spot", o.cone->focal_spot},
                    {"supersampling", o.cone->supersampling}};
  return text.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

InputReport make_report(const Phantom& phantom, const SimulateOptions& o, double noise,
                        std::int64_t truncated) {
  InputReport r;
  r.name = phantom.name;
  r.format = "simulated";
  r.center_source = "default";
  r.sha256 = sha256_of_text(options_text(phantom, o));
  if (truncated > 0)
    r.notes.push_back(
        fmt::format("{} of {} views: the object reaches beyond the detector in u, projections are truncated",
                    truncated, o.angles));
  if (noise > 0)
    r.notes.push_back(
        fmt::format("Gaussian noise of standard deviation {:.6g} was added, seed {}", noise, o.seed));
  return r;
}

}  // namespace

std::vector<std::array<double, 2>> read_shifts(const std::filesystem::path& path, std::int64_t views) {
  io::RawScan raw;
  raw.projections.count = views;
  io::state_shifts(raw, io::read_numbers(path), path.string());
  std::vector<std::array<double, 2>> shifts;
  for (std::size_t k = 0; k < raw.shift_u.size(); ++k)
    shifts.push_back({raw.shift_u[k], raw.shift_v.empty() ? 0.0 : raw.shift_v[k]});
  return shifts;
}

ProjectionSet simulate(const Phantom& phantom, const SimulateOptions& options, const Progress& progress) {
  check(phantom, options);
  const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  check_memory(options, threads);
  try {
    ProjectionSet scan;
    Simulator simulator(phantom, options, threads);
    scan.geometry = {options.columns,
                     options.rows,
                     options.pitch_u,
                     options.pitch_v,
                     static_cast<double>(options.columns - 1) / 2 - options.detector_offset,
                     options.unit,
                     simulator.theta()};
    for (const auto& [du, dv] : options.shifts) {
      scan.geometry.column_shift.push_back(du / options.pitch_u);
      scan.geometry.row_shift.push_back(dv / options.pitch_v);
    }
    for (std::vector<double>* shift : {&scan.geometry.column_shift, &scan.geometry.row_shift})
      if (std::all_of(shift->begin(), shift->end(), [](double s) { return s == 0; })) shift->clear();
    scan.geometry.axis_roll_deg = options.axis_roll_deg;
    if (options.cone) {
      scan.cone = cone_geometry_of(options);
      scan.geometry = parallel_limit(*scan.cone, options.columns, options.rows, options.unit);
    }
    const auto size = static_cast<std::size_t>(scan.size());
    scan.data =
        SampleArray(size, scratch_for(size * sizeof(float), options.max_memory_bytes, options.scratch),
                    "the projections");
    const bool noisy = options.noise_sigma > 0;
    const double noise = noisy ? options.noise_sigma * simulator.largest(progress) : 0;
    simulator.run(noise, noisy ? 0.5 : 0, progress, scan.data);
    scan.report = make_report(phantom, options, noise, simulator.truncated_views());
    if (options.cone) scan.report.source_to_detector = options.cone->source_to_detector;
    return scan;
  } catch (const std::bad_alloc&) {
    throw ResourceError(
        fmt::format("simulate: no memory for {} views of {} x {} with binning {}; use fewer views, a smaller "
                    "detector or less binning",
                    options.angles, options.columns, options.rows, options.binning));
  }
}

}  // namespace vdvr
