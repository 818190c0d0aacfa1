// A scan from whatever file holds it: told apart by content, read block by block, pre-processed in double,
// rounded to float once; then the centre. Layout float data[view][v][u]. Called by every command that takes a
// scan; calls host/io readers, host/scan/preprocess.cpp and host/center/find_center.cpp.
#include "vdvr/read_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <future>
#include <numbers>
#include <thread>

#include "host/io/raster_file.hpp"
#include "host/prepare/prepare.hpp"
#include "host/scan/hdf5_scan.hpp"
#include "host/scan/photon_transfer.hpp"
#include "host/scan/preprocess.hpp"
#include "host/scan/raster_scan.hpp"
#include "host/scan/scan_folder.hpp"
#include "host/system/limits.hpp"
#include "host/system/rehearsal.hpp"
#include "vdvr/error.hpp"
#include "vdvr/find_center.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/output_file.hpp"

namespace vdvr {

const char* text_of(Beam beam) { return beam == Beam::cone ? "cone" : "parallel"; }

std::optional<Beam> beam_of(const std::string& text) {
  for (const Beam beam : {Beam::parallel, Beam::cone})
    if (text == text_of(beam)) return beam;
  return {};
}

namespace {

namespace fs = std::filesystem;

// --- which reader ---

// The signature may follow a user block of 512, 1024, ... bytes (HDF5 File Format Specification, III.A).
bool is_hdf5(const fs::path& path) {
  const std::string signature("\x89HDF\r\n\x1a\n", 8);
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  for (std::uint64_t at = 0; !error && at + signature.size() <= size; at = at == 0 ? 512 : 2 * at) {
    std::string start(signature.size(), '\0');
    file.seekg(static_cast<std::streamoff>(at));
    if (!file.read(start.data(), static_cast<std::streamsize>(start.size()))) return false;
    if (start == signature) return true;
  }
  return false;
}

bool is_json(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  char c = 0;
  file >> std::ws >> c;
  return c == '{';
}

io::RawScan open_scan(const fs::path& path, const ScanOptions& options, bool& folder) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) throw FileError(path.string() + ": no such file or folder");
  folder = fs::is_directory(status);
  const bool raster = !folder && io::is_raster_file(path);
  if (options.angles_file && !raster)
    throw InputError(path.string() +
                     ": an angles file goes with an MHA or NRRD stack; other scans bring their angles");
  if (folder) return io::open_scan_folder(path, options.max_memory_bytes, options.beam, options.follow_links);
  if (!fs::is_regular_file(status)) throw FileError(path.string() + ": is neither a file nor a folder");
  if (fs::file_size(path, error) == 0) throw FileError(path.string() + ": is empty");
  const bool cone = options.beam == Beam::cone;
  if (is_hdf5(path)) {
    io::RawScan raw = io::open_hdf5_scan(path, {}, options.follow_links, cone);
    if (raw.cone)
      raw.notes.insert(raw.notes.end(), raw.cone->geometry.notes.begin(), raw.cone->geometry.notes.end());
    return raw;
  }
  if (raster && cone)
    throw InputError(
        path.string() +
        ": a stack states no distances, so cone beam (`beam`) cannot be read from it; describe the scan "
        "in scan.json by 'geometry'");
  if (raster) {
    if (!options.angles_file)
      throw InputError(path.string() + ": a stack needs its angles; give them with `angles_file`");
    return io::open_raster_scan(path, *options.angles_file);
  }
  if (is_json(path)) {
    if (path.filename() != "scan.json")
      throw FileError(path.string() + ": a scan's description is named scan.json");
    folder = true;
    return io::open_scan_folder(path.has_parent_path() ? path.parent_path() : ".", options.max_memory_bytes,
                                options.beam, options.follow_links);
  }
  throw FileError(path.string() +
                  ": is no scan: not HDF5 (Data Exchange, NXtomo), not a folder with scan.json, not an MHA "
                  "or NRRD stack; or its first bytes are missing");
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
      throw FileError(fmt::format("{}: angle {} is {}", name, k, raw.theta_deg[k]));
    g.theta_rad.push_back(raw.theta_deg[k] * (std::numbers::pi / 180));
  }
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
                  std::uint64_t preparation_bytes = 0) {
  const std::array<std::int64_t, 3> all{raw.projections.count, raw.rows, raw.columns};
  const std::array<std::int64_t, 3> block{block_views(raw, options.max_memory_bytes), raw.rows, raw.columns};
  const std::uint64_t samples = io::checked_bytes(all, sizeof(float), name),
                      resident = options.max_memory_bytes == 0
                                     ? samples
                                     : std::min(samples, options.max_memory_bytes / 8);
  const std::uint64_t cores = std::max(1u, std::thread::hardware_concurrency());
  io::require_memory(
      resident + 2 * io::checked_bytes(block, sizeof(double), name) + cores * preparation_bytes,
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
                  ProjectionSet& scan, const Progress& progress) {
  const std::int64_t size = raw.rows * raw.columns, step = block_views(raw, options.max_memory_bytes);
  FlatField field;
  if (raw.counts) {
    field = make_flat_field(raw.flats, raw.darks, raw.rows, raw.columns, raw.integer);
    scan.report.transmission_floor = field.floor;
  }
  const auto samples = static_cast<std::size_t>(raw.projections.count * size);
  scan.data =
      SampleArray(samples, scratch_for(samples * sizeof(float), options.max_memory_bytes, options.scratch),
                  "the projections");
  std::vector<double> block(static_cast<std::size_t>(step * size));
  std::vector<std::int64_t> dead(static_cast<std::size_t>(step));
  std::atomic<bool> rounds = false;
  std::atomic<std::int64_t> outliers = 0;
  for (std::int64_t first = 0; first < raw.projections.count; first += step) {
    const std::int64_t n = std::min(step, raw.projections.count - first);
    raw.projections.read(first, n, block.data());
    for_each_view(n, [&](std::int64_t k) {
      const std::span<double> view(block.data() + k * size, static_cast<std::size_t>(size));
      if (raw.counts)
        dead[static_cast<std::size_t>(k)] =
            to_line_integrals(view, raw.rows, raw.columns, field, raw.projections.name(first + k));
      else {
        require_finite(view, raw, first + k);
        if (std::any_of(view.begin(), view.end(),
                        [](double p) { return static_cast<double>(static_cast<float>(p)) != p; }))
          rounds = true;
      }
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
    for (std::int64_t k = 0; k < n; ++k) scan.report.dead_pixels += dead[static_cast<std::size_t>(k)];
    report(progress, "read", static_cast<double>(first + n) / static_cast<double>(raw.projections.count));
  }
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

void require_on_detector(const fs::path& path, double center, std::int64_t columns,
                         const ScanOptions& options) {
  const double last = static_cast<double>(columns) - 0.5;
  if (!(center >= -0.5 && center <= last)) {
    const std::string text =
        fmt::format("{}: centre {} is not on the detector's columns -0.5 to {}", path.string(), center, last);
    if (options.center) throw InputError(text);
    throw FileError(text);
  }
}

// In columns of the file.
std::string note_of(const CenterEstimate& found, int binning) {
  const double column = unbinned_center(found.center, binning);
  std::string others;
  for (const CenterWitness& w : found.others)
    if (w.quality >= 0.5)
      others += fmt::format("{} {} {:.2f}", others.empty() ? "; beside it" : ",", w.method,
                            unbinned_center(w.center, binning));
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
  if (options.center) {
    g.center = *options.center;
    r.center_source = "option";
  } else if (raw.center) {
    g.center = binned_center(*raw.center, options.preparation.binning);
    r.center_source = "file";
  } else if (const auto found = find_center(scan)) {
    g.center = found->center;
    r.center_source = "found";
    r.notes.push_back(note_of(*found, options.preparation.binning));
  } else {
    g.center = 0.5 * static_cast<double>(g.columns - 1);
    r.center_source = "default";
    r.notes.push_back(
        fmt::format("centre of rotation assumed in the detector's middle, column {}: the views do not tell; "
                    "`vdvr center` draws slices to choose from, `center` sets it",
                    unbinned_center(g.center, options.preparation.binning)));
  }
  require_on_detector(path, g.center, g.columns, options);
}

// --- cone beam ---

// All views moved alike, so that the isocentre is seen at column `wanted` on the average. Where it is but for
// the mean's rounding, nothing moves: a certificate's centre gives the matrices that it was made of.
void move_axis(ConeGeometry& cone, double wanted) {
  double mean = 0, largest = 0;
  const auto views = static_cast<double>(cone.views.size());
  for (const ViewMatrix& m : cone.views) {
    mean += m[0][3] / m[2][3] / views;
    largest = std::max(largest, std::abs(m[0][3] / m[2][3]));
  }
  if (std::abs(wanted - mean) <= (2 * views + 4) * 0x1p-53 * largest) return;
  for (ViewMatrix& m : cone.views) m = recentred(m, m[0][3] / m[2][3] + wanted - mean);
}

// The opposite views, which would see what the narrower side does not, do not exist. Who states a full turn
// has it so.
void require_no_displaced_short_scan(const fs::path& path, const ConeGeometry& cone,
                                     const ParallelGeometry& g) {
  const SourceArc arc = source_arc(cone);
  const double below = g.center, above = static_cast<double>(g.columns - 1) - g.center;
  const bool open = cone.redundancy == Redundancy::short_scan ||
                    natural_redundancy(cone, g.columns) == Redundancy::short_scan;
  const bool displaced =
      cone.redundancy == Redundancy::displaced || std::abs(above - below) >= 0.1 * (above + below);
  if (open && displaced && cone.redundancy != Redundancy::full_turn)
    throw FileError(fmt::format(
        "{}: a short scan ({:.1f} degrees) whose axis is seen at column {:.2f} of {}: the opposite views "
        "that would see the far side do not exist; crop the wider side of the detector, or measure a full "
        "turn",
        path.string(), arc.arc_rad * (180 / std::numbers::pi), g.center, g.columns));
}

void set_cone(const fs::path& path, const io::RawScan& raw, const ScanOptions& options, ProjectionSet& scan) {
  ConeGeometry cone;
  cone.views = raw.cone->geometry.views;
  InputReport& r = scan.report;
  r.source_to_detector = raw.cone->geometry.source_to_detector;
  r.center_source = options.center ? "option" : raw.center ? "file" : raw.cone->geometry.center_source;
  std::optional<double> wanted = raw.center;
  if (options.center) wanted = unbinned_center(*options.center, options.preparation.binning);
  if (wanted) {
    require_on_detector(path, *wanted, raw.columns, options);
    move_axis(cone, *wanted);
    r.notes.push_back(fmt::format("all views were moved so that the axis is at column {:g}, as {} says",
                                  *wanted, options.center ? "`center`" : "scan.json's 'center'"));
  }
  cone.redundancy = raw.cone->redundancy.value_or(natural_redundancy(cone, raw.columns));
  scan.geometry = parallel_limit(cone, raw.columns, raw.rows, raw.unit);
  require_on_detector(path, scan.geometry.center, raw.columns, options);
  require_no_displaced_short_scan(path, cone, scan.geometry);
  const SourceArc arc = source_arc(cone);
  r.notes.push_back(
      fmt::format("weights of a {} scan, as {}: sources over {:.1f} degrees, axis at column {:.2f}",
                  text_of(cone.redundancy), raw.cone->redundancy ? "scan.json says" : "the views tell",
                  arc.arc_rad * (180 / std::numbers::pi), scan.geometry.center));
  scan.cone = std::move(cone);
}

// A description that may name an HDF5 file: by its member, or by a letter of it written as \\u0068.
bool may_name_hdf5(const fs::path& description) {
  std::error_code error;
  if (!fs::is_regular_file(description, error)) return false;
  constexpr std::uintmax_t largest = 16u << 20;  // the reader refuses a larger one
  std::string text(std::min(fs::file_size(description, error), largest), '\0');
  std::ifstream file(description, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text.find("hdf5") != std::string::npos || text.find('\\') != std::string::npos;
}

bool holds_hdf5(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return may_name_hdf5(path / "scan.json");
  if (!fs::is_regular_file(path, error)) return false;
  return is_hdf5(path) || (path.filename() == "scan.json" && may_name_hdf5(path));
}

// Everything that comes from the files, and nothing kept.
void read_frames(const fs::path& path, const ScanOptions& options) {
  bool folder = false;
  const io::RawScan raw = open_scan(path, options, folder);
  std::uint64_t bytes = 0;
  for (const auto& stamp : stamps_of(raw)) bytes += stamp.first;
  io::extend_rehearsal(bytes);
  static_cast<void>(geometry_of(raw, path.string()));
  require_room(raw, options, path.string());
  const std::int64_t step = block_views(raw, options.max_memory_bytes);
  std::vector<double> block(static_cast<std::size_t>(step * raw.rows * raw.columns));
  for (const io::Frames* frames : {&raw.projections, &raw.flats, &raw.darks})
    for (std::int64_t first = 0; first < frames->count; first += step)
      frames->read(first, std::min(step, frames->count - first), block.data());
}

ProjectionSet read_whole(const fs::path& path, const ScanOptions& options, const Progress& progress) {
  if (holds_hdf5(path)) io::rehearse(path, options.max_memory_bytes, [&] { read_frames(path, options); });
  bool folder = false;
  const io::RawScan raw = open_scan(path, options, folder);
  ProjectionSet scan;
  scan.report.name = name_of(path, folder);
  scan.report.format = raw.format;
  scan.report.notes = raw.notes;
  scan.geometry = geometry_of(raw, path.string());
  const ViewPreparation preparation(options.preparation, scan.geometry, raw.cone.has_value());
  if (raw.cone) set_cone(path, raw, options, scan);
  require_room(raw, options, path.string(), preparation.bytes());
  const auto before = stamps_of(raw);
  read_samples(raw, options, preparation, scan, progress);
  const std::int64_t samples = scan.size();
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
  scan.report.preparation = for_columns(options.preparation, raw.columns);
  prepare_scan(scan, scan.report.preparation, options.max_memory_bytes, progress);
  if (!raw.cone) choose_center(path, raw, options, scan);
  return scan;
}

}  // namespace

ProjectionSet read_scan(const fs::path& path, const ScanOptions& options, const Progress& progress) {
  try {
    return read_whole(path, options, progress);
  } catch (const std::bad_alloc&) {
    throw ResourceError(path.string() + ": not enough memory to read the scan");
  }
}

std::optional<LineIntegralNoise> read_line_noise(const fs::path& path, const ScanOptions& options) {
  if (holds_hdf5(path)) io::rehearse(path, options.max_memory_bytes, [&] { read_frames(path, options); });
  bool folder = false;
  const io::RawScan raw = open_scan(path, options, folder);
  if (!raw.counts) return std::nullopt;
  std::optional<LineIntegralNoise> noise = photon_transfer(raw.flats, raw.darks, raw.rows, raw.columns);
  if (noise) noise = binned(*noise, raw.rows, raw.columns, options.preparation.binning);
  return noise;
}

}  // namespace vdvr
