// A scan from whatever file holds it: told apart by content, read block by block, pre-processed in double,
// rounded to float once; then the centre. Layout float data[view][v][u].
#include "vdvr/read_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <numbers>
#include <thread>

#include "host/base/system/limits.hpp"
#include "host/base/system/read_in_child.hpp"
#include "host/scan/cone_scan.hpp"
#include "host/scan/flats_in_time.hpp"
#include "host/scan/motion.hpp"
#include "host/scan/open/open_scan.hpp"
#include "host/scan/photon_transfer.hpp"
#include "host/scan/prepare/heights.hpp"
#include "host/scan/prepare/prepare.hpp"
#include "host/scan/preprocess.hpp"
#include "host/scan/scan_report.hpp"
#include "host/scan/values.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/find_center.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

// The scan as its files, scan.json and the options describe it.
io::RawScan open_described(const fs::path& path, const ScanOptions& options, bool& folder) {
  io::RawScan raw = io::open_scan(path, options, folder);
  io::settle_values(raw, options.input, path.string());
  return raw;
}

// --- geometry and memory ---

// Of cone beam the detector alone.
ParallelGeometry geometry_of(const io::RawScan& raw, const std::string& name) {
  ParallelGeometry g;
  g.columns = raw.columns;
  g.rows = raw.rows;
  g.unit = raw.unit;
  if (raw.projections.count < 1) throw FileError(fmt::format("{}: holds no projections", name));
  if (raw.cone) return g;
  g.pitch_u = raw.pitch_u;
  g.pitch_v = raw.pitch_v;
  for (const double pitch : {g.pitch_u, g.pitch_v})
    if (!(pitch > 0) || !std::isfinite(pitch))
      throw FileError(fmt::format("{}: pitch {}; it must be positive", name, pitch));
  for (std::size_t k = 0; k < raw.theta_deg.size(); ++k) {
    if (!std::isfinite(raw.theta_deg[k]))
      throw FileError(fmt::format("{}: angle {} is {}; correct it, or leave that view out by `views`", name,
                                  k, raw.theta_deg[k]));
    g.theta_rad.push_back(raw.theta_deg[k] * (std::numbers::pi / 180));
  }
  io::require_radians(name, "angles", g.theta_rad, io::not_radians);
  return g;
}

// Views per block: about 32 MiB as double, less under a small limit, keeps reads long and memory small.
std::int64_t block_views(const io::RawScan& raw, std::uint64_t max_memory_bytes) {
  constexpr std::int64_t most_samples = std::int64_t{1} << 22;
  const std::int64_t block_samples =
      max_memory_bytes == 0 ? most_samples
                            : std::min(most_samples, static_cast<std::int64_t>(max_memory_bytes / 64));
  return std::clamp<std::int64_t>(block_samples / (raw.rows * raw.columns), 1, raw.projections.count);
}

void require_room(const io::RawScan& raw, const ScanOptions& options, const std::string& name,
                  std::uint64_t preparation_bytes = 0, std::uint64_t flats_bytes = 0) {
  const std::array<std::int64_t, 3> all{raw.projections.count, raw.rows, raw.columns};
  const std::array<std::int64_t, 3> block{block_views(raw, options.max_memory_bytes), raw.rows, raw.columns};
  const std::uint64_t samples = io::checked_bytes(all, sizeof(float), name),
                      resident = options.max_memory_bytes == 0
                                     ? samples
                                     : std::min(samples, options.max_memory_bytes / 8);
  const std::uint64_t cores = std::max(1u, std::thread::hardware_concurrency());
  io::require_memory(
      resident + 2 * io::checked_bytes(block, sizeof(double), name) + cores * preparation_bytes + flats_bytes,
      options.max_memory_bytes, name + ": the projections");
}

// --- samples ---

// Runs `work(k)` for k < count on all cores; the first exception comes out here.
template <typename Work>
void for_each_view(std::int64_t count, const Work& work) {
  const std::int64_t workers = std::clamp<std::int64_t>(std::thread::hardware_concurrency(), 1, count);
  // Later, in this thread, where the system has no thread left.
  constexpr auto thread_or_later = std::launch::async | std::launch::deferred;
  std::vector<std::future<void>> running;
  for (std::int64_t w = 0; w < workers; ++w)
    running.push_back(std::async(thread_or_later, [&work, w, workers, count] {
      for (std::int64_t k = w; k < count; k += workers) work(k);
    }));
  for (auto& r : running) r.wait();
  for (auto& r : running) r.get();
}

void require_finite(std::span<const double> view, const io::RawScan& raw, std::int64_t k) {
  for (std::size_t i = 0; i < view.size(); ++i)
    if (!std::isfinite(static_cast<float>(view[i])))
      throw FileError(fmt::format("{}: line integral [{}][{}][{}] is {}; it must be a finite float",
                                  raw.projections.name(k), k, static_cast<std::int64_t>(i) / raw.columns,
                                  static_cast<std::int64_t>(i) % raw.columns, view[i]));
}

void read_samples(const io::RawScan& raw, const ScanOptions& options, const ViewPreparation& preparation,
                  FlatsInTime& in_time, ProjectionSet& scan, io::ValueTotals& totals, Understood& understood,
                  const Progress& progress) {
  const std::int64_t size = raw.rows * raw.columns, step = block_views(raw, options.max_memory_bytes);
  FlatField field;
  if (raw.counts) {
    field = make_flat_field(raw.flats, raw.darks, raw.rows, raw.columns, raw.integer);
    scan.report.transmission_floor = field.floor;
  }
  const double full = raw.counts && !raw.flat_level ? io::saturation_of(raw, field.largest_flat) : 0;
  const auto samples = static_cast<std::size_t>(raw.projections.count * size);
  scan.data = SampleArray(samples,
                          scratch_for_scan(raw.projections.count, raw.rows, raw.columns,
                                           options.max_memory_bytes, options.scratch),
                          "the projections");
  std::vector<double> block(static_cast<std::size_t>(step * size));
  std::vector<std::int64_t> dead(static_cast<std::size_t>(step)), blank;
  std::vector<io::ValueTotals> of_view(static_cast<std::size_t>(step));
  std::atomic<bool> rounds = false;
  std::atomic<std::int64_t> outliers = 0;
  for (std::int64_t first = 0; first < raw.projections.count; first += step) {
    const std::int64_t n = std::min(step, raw.projections.count - first);
    raw.projections.read(first, n, block.data());
    if (!in_time.none()) in_time.go_to(first, n, field.dark);
    for_each_view(n, [&](std::int64_t k) {
      const std::span<double> view(block.data() + k * size, static_cast<std::size_t>(size));
      io::ValueTotals& own = of_view[static_cast<std::size_t>(k)] = {};
      if (raw.counts) {
        if (full > 0) own.saturated = std::count(view.begin(), view.end(), full);
        std::int64_t& replaced = dead[static_cast<std::size_t>(k)] =
            in_time.none() ? to_line_integrals(view, raw.rows, raw.columns, field)
                           : to_line_integrals(view, raw.rows, raw.columns, field, in_time.gain(first + k));
        if (replaced == size) return;
      } else {
        require_finite(view, raw, first + k);
        if (std::any_of(view.begin(), view.end(),
                        [](double p) { return static_cast<double>(static_cast<float>(p)) != p; }))
          rounds = true;
      }
      own.add(view, raw.columns);
      if (!preparation.none()) {
        View copy{raw.columns, raw.rows, {view.begin(), view.end()}};
        outliers += preparation.apply(copy);
        require_finite(copy.data, raw, first + k);
        std::copy(copy.data.begin(), copy.data.end(), view.begin());
      }
      if (!raw.air_columns.empty()) subtract_air_background(view, raw.rows, raw.columns, raw.air_columns);
      std::transform(view.begin(), view.end(), scan.data.begin() + (first + k) * size,
                     [](double p) { return static_cast<float>(p); });
    });
    for (std::int64_t k = 0; k < n; ++k) {
      const auto i = static_cast<std::size_t>(k);
      scan.report.dead_pixels += dead[i];
      if (raw.counts && dead[i] == size) blank.push_back(first + k);
      else totals.add(of_view[i]);
    }
    report(progress, "read", static_cast<double>(first + n) / static_cast<double>(raw.projections.count));
  }
  if (!blank.empty()) refuse_blank(raw, blank, field.floor);
  note_saturated(field, full, totals, raw.flats.count * size, understood);
  scan.report.air_background = !raw.air_columns.empty();
  if (options.preparation.outliers)
    scan.report.notes.push_back(fmt::format("{} of {} samples were outliers and got the median of {} x {}",
                                            outliers.load(), samples, options.preparation.outliers->window,
                                            options.preparation.outliers->window));
  if (rounds)
    scan.report.notes.push_back(
        "the scan holds float64 or wide integers: F is that of its values rounded to float32");
}

// --- report ---

// One file: its own hash. Several: the hash of the sorted lines "sha256 name\n".
std::string hash_of(const io::RawScan& raw, bool folder) {
  if (!folder && raw.files.size() == 1) return sha256_of_file(raw.files.front().second);
  std::vector<std::string> lines;
  for (const auto& [name, path] : raw.files) lines.push_back(sha256_of_file(path) + " " + name + "\n");
  std::sort(lines.begin(), lines.end());
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  std::string text;
  for (const auto& line : lines) text += line;
  return sha256_of_text(text);
}

// Length and time of last change: what tells that somebody wrote into a file while it was read.
std::vector<std::pair<std::uintmax_t, fs::file_time_type>> stamps_of(const io::RawScan& raw) {
  std::vector<std::pair<std::uintmax_t, fs::file_time_type>> stamps;
  for (const auto& file : raw.files) {
    std::error_code gone;
    const std::uintmax_t bytes = fs::file_size(file.second, gone);
    stamps.emplace_back(bytes, fs::last_write_time(file.second, gone));
  }
  return stamps;
}

std::string name_of(const fs::path& path, bool folder) {
  fs::path whole = fs::absolute(path).lexically_normal();
  if (folder && whole.filename() == "scan.json") whole = whole.parent_path();
  if (!whole.has_filename()) whole = whole.parent_path();
  return whole.filename().string();
}

// In columns of the file.
std::string note_of(const CenterEstimate& found, std::int64_t cut, int binning) {
  const auto column_of = [&](double center) {
    return unbinned_center(center + static_cast<double>(cut), binning);
  };
  const double column = column_of(found.center);
  std::string others;
  for (const CenterWitness& w : found.others)
    if (w.quality >= 0.5)
      others +=
          fmt::format("{} {} {:.2f}", others.empty() ? "; beside it" : ",", w.method, column_of(w.center));
  if (!found.sure)
    return fmt::format(
        "centre of rotation UNSURE: column {:.2f} from {}, but {}{}; look at slices around it with `vdvr "
        "center`, then give `center`",
        column, found.method, found.doubt, others);
  return fmt::format("centre of rotation found from {}: column {:.2f} +- {:.2g}{}", found.method, column,
                     std::max(0.01, found.uncertainty * binning), others);
}

void choose_center(const fs::path& path, const io::RawScan& raw, const ScanOptions& options,
                   ProjectionSet& scan) {
  ParallelGeometry& g = scan.geometry;
  InputReport& r = scan.report;
  const auto cut = static_cast<double>(g.extension.cut);  // what is stated counts the detector's columns
  if (options.center) {
    g.center = *options.center - cut;
    r.center_source = "option";
  } else if (raw.center) {
    g.center = binned_center(*raw.center, options.preparation.binning) - cut;
    r.center_source = "file";
  } else if (const auto found = find_center(scan)) {
    g.center = found->center;
    r.center_source = "found";
    r.notes.push_back(note_of(*found, g.extension.cut, options.preparation.binning));
  } else {
    g.center = 0.5 * static_cast<double>(g.columns - 1);
    r.center_source = "default";
    r.notes.push_back(
        fmt::format("centre of rotation assumed in the detector's middle, column {}: the views do not tell; "
                    "`vdvr center` draws slices to choose from, `center` sets it",
                    unbinned_center(g.center + cut, options.preparation.binning)));
  }
  require_on_detector(path, g.center, g.columns, options);
}

// What is stated of half acquisition: by the options, else by the files.
Preparation wanted_of(const io::RawScan& raw, const ScanOptions& options) {
  Preparation wanted = options.preparation;
  if (!wanted.half_acquisition && !raw.cone) wanted.half_acquisition = raw.half_acquisition;
  return wanted;
}

void extend(const fs::path& path, const io::RawScan& raw, const ScanOptions& options, ProjectionSet& scan,
            Understood& understood) {
  const Preparation wanted = wanted_of(raw, options);
  try {
    const std::string recognised = extend_rows(scan, wanted, options.max_memory_bytes, options.scratch);
    if (recognised.empty()) return;
    understood.warnings.push_back(recognised);
    scan.report.notes.insert(scan.report.notes.begin(), recognised);
  } catch (InputError& e) {
    e.add_context(path.string());
    throw;
  }
}

void bring_rows_to_heights(const fs::path& path, const io::RawScan& raw, const ScanOptions& options,
                           ProjectionSet& scan) {
  try {
    bring_to_heights(scan, wanted_of(raw, options), options.max_memory_bytes, options.scratch);
  } catch (const InputError& e) {
    throw FileError(path.string() + ": " + e.what() + io::part_at_rest(raw, scan.geometry.pitch_v));
  }
}

FlatsInTime flats_in_time(const fs::path& path, const io::RawScan& raw, const ScanOptions& options) {
  try {
    return {raw, options.preparation};
  } catch (InputError& e) {
    e.add_context(path.string());
    throw;
  }
}

// Throws what opening a damaged file would crash of.
void try_to_open(const fs::path& path, const ScanOptions& options) {
  if (!io::holds_hdf5(path)) return;
  io::read_in_child(path, options.max_memory_bytes, [&] {
    bool folder = false;
    const io::RawScan raw = open_described(path, options, folder);
    static_cast<void>(geometry_of(raw, path.string()));
    require_room(raw, options, path.string());
  });
}

// From here on a child reads the frames of HDF5.
void read_frames_in_child(const fs::path& path, const ScanOptions& options, io::RawScan& raw) {
  if (!io::holds_hdf5(path)) return;
  std::uint64_t file_bytes = 0;
  for (const auto& stamp : stamps_of(raw)) file_bytes += stamp.first;
  const auto numbers = static_cast<std::uint64_t>(raw.rows * raw.columns);
  const std::array<io::Frames*, 3> stacks{&raw.projections, &raw.flats, &raw.darks};
  const auto reader = std::make_shared<io::FrameReader>(
      path, options.max_memory_bytes, file_bytes, numbers,
      static_cast<std::uint64_t>(block_views(raw, options.max_memory_bytes)) * numbers * sizeof(double),
      [reads = std::array{stacks[0]->read, stacks[1]->read, stacks[2]->read}](const io::FrameBlock& block,
                                                                              double* out) {
        reads[static_cast<std::size_t>(block.stack)](block.first, block.frames, out);
      });
  for (std::size_t i = 0; i < stacks.size(); ++i)
    stacks[i]->read = [reader, i](std::int64_t first, std::int64_t n, double* out) {
      reader->read({static_cast<std::int64_t>(i), first, n}, out);
    };
}

// Weights of a series depend on whether it is one, and where the axis is, its rows tell.
bool is_series_of_half_acquisition(const ParallelGeometry& g, const Preparation& wanted) {
  return !g.series.none() && !g.series.full_turn && !wanted.half_acquisition && g.column_shift.empty() &&
         looks_half_acquired(g);
}

ProjectionSet read_whole(const fs::path& path, const ScanOptions& options, const Progress& progress,
                         Understood& understood);

ProjectionSet read_series_of_half_acquisition(const fs::path& path, ScanOptions options,
                                              const Progress& progress, Understood& understood) {
  options.preparation.half_acquisition = true;
  understood = {};
  ProjectionSet scan = read_whole(path, options, progress, understood);
  understood.warnings.emplace_back(
      "half acquisition: the axis is off the middle of a scan all around, so that opposite views "
      "of the series are taken as rows of a wider detector; `half_acquisition` off says otherwise");
  scan.report.notes.insert(scan.report.notes.begin(), understood.warnings.back());
  return scan;
}

ProjectionSet read_whole(const fs::path& path, const ScanOptions& options, const Progress& progress,
                         Understood& understood) {
  try_to_open(path, options);
  bool folder = false;
  io::RawScan raw = open_described(path, options, folder);
  ProjectionSet scan;
  scan.report.name = name_of(path, folder);
  scan.report.format = raw.format;
  describe(raw, options, understood);
  scan.geometry = geometry_of(raw, path.string());
  const ViewPreparation preparation(options.preparation, scan.geometry, raw.cone.has_value());
  if (raw.cone) set_cone(path, raw, options, scan);
  io::set_shifts(raw, path.string(), scan.geometry);
  scan.report.notes.insert(scan.report.notes.begin(), raw.notes.begin(), raw.notes.end());
  require_room(raw, options, path.string());
  const auto before = stamps_of(raw);
  read_frames_in_child(path, options, raw);
  FlatsInTime in_time = flats_in_time(path, raw, options);
  require_room(raw, options, path.string(), preparation.bytes(),
               in_time.bytes(block_views(raw, options.max_memory_bytes)));
  io::ValueTotals totals;
  read_samples(raw, options, preparation, in_time, scan, totals, understood, progress);
  const std::int64_t samples = scan.size();
  require_alive(raw, scan.report.dead_pixels, samples, path.string());
  io::judge_values(totals, raw, path.string());
  scan.report.sha256 = hash_of(raw, folder);
  if (const auto after = stamps_of(raw); after != before) {
    const auto changed = std::mismatch(before.begin(), before.end(), after.begin()).first - before.begin();
    throw FileError(fmt::format("{}: was changed while it was read; start again once it is whole",
                                raw.files[static_cast<std::size_t>(changed)].second.string()));
  }
  if (scan.report.dead_pixels > 0)
    scan.report.notes.push_back(
        fmt::format("{} of {} samples were dead and got the median of their neighbours",
                    scan.report.dead_pixels, samples));
  if (options.angles_file)
    scan.report.notes.push_back("the hash covers the stack, not the angles file, whose sha256 is " +
                                sha256_of_file(*options.angles_file));
  auto& warnings = understood.warnings;
  warnings.insert(warnings.begin(), raw.warnings.begin(), raw.warnings.end());
  scan.report.notes.insert(scan.report.notes.begin(), warnings.begin(), warnings.end());
  scan.report.preparation = for_columns(options.preparation, raw.columns);
  for (std::string& words : in_time.record(scan.report.preparation))
    scan.report.notes.push_back(std::move(words));
  prepare_scan(scan, scan.report.preparation, options.max_memory_bytes, progress);
  bring_rows_to_heights(path, raw, options, scan);
  if (!raw.cone) choose_center(path, raw, options, scan);
  if (is_series_of_half_acquisition(scan.geometry, wanted_of(raw, options)))
    return read_series_of_half_acquisition(path, options, progress, understood);
  extend(path, raw, options, scan, understood);
  return scan;
}

}  // namespace

ProjectionSet read_scan(const fs::path& path, const ScanOptions& options, const Progress& progress,
                        Understood* understood) {
  Understood found;
  try {
    ProjectionSet scan = read_whole(path, options, progress, found);
    if (understood) *understood = std::move(found);
    return scan;
  } catch (const std::bad_alloc&) {
    throw ResourceError(path.string() + ": not enough memory to read the scan");
  }
}

std::optional<LineIntegralNoise> read_line_noise(const fs::path& path, const ScanOptions& options) {
  try_to_open(path, options);
  bool folder = false;
  io::RawScan raw = open_described(path, options, folder);
  if (!raw.counts) return std::nullopt;
  read_frames_in_child(path, options, raw);
  std::optional<LineIntegralNoise> noise =
      photon_transfer(raw.flats, raw.darks, raw.rows, raw.columns, runs_of_flats(raw));
  if (noise) noise = binned(*noise, raw.rows, raw.columns, options.preparation.binning);
  return noise;
}

}  // namespace vdvr
