// vdvr probe: values at the points of a CSV, from a certified volume, a volume, or the exact field of
// projections.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_points.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/d2vr.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr::cli {
namespace {

/// One line of the result; what is absent is an empty field.
struct Probe {
  bool covered = false;
  std::optional<double> value, bound, sigma;
  std::string level;
};

Vec3 parse_point(const std::string& line, const std::string& where) {
  Vec3 point{};
  std::size_t begin = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t comma = line.find(',', begin);
    if ((comma == std::string::npos) != (a == 2))
      throw FileError(fmt::format("{}: '{}' is not x,y,z", where, line));
    std::string field = line.substr(begin, a == 2 ? std::string::npos : comma - begin);
    field.erase(std::remove(field.begin(), field.end(), ' '), field.end());
    try {
      point[a] = parse_number(where, field);
    } catch (const InputError& e) {
      throw FileError(e.what());
    }
    begin = comma + 1;
  }
  return point;
}

std::vector<Vec3> read_points(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  const auto next_line = [&] {
    if (!std::getline(file, line)) return false;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return true;
  };
  if (!file)
    throw FileError(
        fmt::format("{}: cannot be read; it must be a file of points, one x,y,z a line", path.string()));
  if (!next_line())
    throw FileError(fmt::format("{}: is empty; its first line is the header x,y,z", path.string()));
  if (line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);
  if (line != "x,y,z")
    throw FileError(fmt::format("{}: the header is '{}', not 'x,y,z'", path.string(), line.substr(0, 40)));
  std::vector<Vec3> points;
  for (int number = 2; next_line(); ++number)
    if (!line.empty()) points.push_back(parse_point(line, fmt::format("{}, line {}", path.string(), number)));
  return points;
}

std::string to_csv(const std::vector<Vec3>& points, const std::vector<Probe>& probes, bool sigma) {
  fmt::memory_buffer out;
  // The shortest text that reads back to the same bits.
  const auto number = [&](const std::optional<double>& v) {
    if (v) fmt::format_to(std::back_inserter(out), "{}", *v);
  };
  fmt::format_to(std::back_inserter(out), "x,y,z,value,bound,level,covered{}\n", sigma ? ",sigma" : "");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Probe& probe = probes[i];
    for (const std::optional<double> v : {std::optional(points[i][0]), std::optional(points[i][1]),
                                          std::optional(points[i][2]), probe.value, probe.bound}) {
      number(v);
      out.push_back(',');
    }
    fmt::format_to(std::back_inserter(out), "{},{}", probe.level, probe.covered ? 1 : 0);
    if (sigma) out.push_back(',');
    number(probe.sigma);
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

bool in_box(const Grid& g, const Vec3& p) {
  for (std::size_t a = 0; a < 3; ++a) {
    const double cell = (p[a] - g.origin[a]) / g.spacing[a];
    if (!(cell >= 0 && cell <= static_cast<double>(g.cells[a]))) return false;
  }
  return true;
}

std::string level_text(const LevelTriple& l) {
  return l[0] == l[1] && l[1] == l[2] ? std::to_string(l[0]) : fmt::format("{}{}{}", l[0], l[1], l[2]);
}

std::vector<Probe> probe_certified(const std::filesystem::path& path, const Arguments& args,
                                   const std::vector<Vec3>& points, bool& sigma, const Progress& progress) {
  const VdvrFile file = open_certified(path, args);
  const MixedVolume& volume = file.volume;
  const Certificate& c = file.certificate;
  sigma = c.noise.has_value();
  std::optional<ProjectionSet> scan = noted_geometry(c);
  if (args.has("projections")) scan = load_certified_scan(args.path("projections"), args, c, progress);
  if (!scan)
    throw InputError(
        fmt::format("{}: does not say which points are covered; give --projections", path.string()));
  const CertifiedPoints at(volume, c, scan);
  std::vector<float> values(points.size());
  at.values(points, values, progress);
  std::vector<Probe> probes(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Probe& probe = probes[i];
    probe.covered = at.covered(points[i]);
    if (!probe.covered) continue;
    probe.value = static_cast<double>(values[i]);
    probe.level = level_text(at.level(points[i]));
    if (at.promised(points[i])) probe.bound = c.total_buffer;
    if (sigma) probe.sigma = static_cast<double>(at.sigma(points[i]));
  }
  return probes;
}

std::vector<Probe> probe_volume(const std::filesystem::path& path, const Arguments& args,
                                const std::vector<Vec3>& points) {
  const MixedVolume volume = as_mixed(load_volume(path, args));
  std::vector<Probe> probes(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    probes[i].covered = in_box(volume.grid, points[i]);
    if (!probes[i].covered) continue;
    probes[i].value = static_cast<double>(sample_at(volume, points[i]));
    probes[i].level = "0";
  }
  return probes;
}

std::vector<Probe> probe_exact(const std::filesystem::path& path, const Arguments& args,
                               const std::vector<Vec3>& points, const Progress& progress) {
  if (!args.has("exact"))
    throw InputError(
        fmt::format("{}: is a projection set; --exact gives the field F at the points, or build it first",
                    path.string()));
  FieldOptions field = field_options(args);
  std::optional<Certificate> like;
  if (args.has("like")) {
    if (has_field_options(args))
      throw InputError("--like takes the field options from its file; do not give them again");
    like = open_certified(args.path("like"), args).certificate;
    field = like->field;
  }
  const ExactField exact(
      like ? load_certified_scan(path, args, *like, progress) : load_scan(path, args, field, progress), field,
      progress);
  std::vector<Probe> probes(points.size());
  std::vector<Vec3> covered;
  for (std::size_t i = 0; i < points.size(); ++i)
    if ((probes[i].covered = exact.covered(points[i]))) covered.push_back(points[i]);
  const std::vector<double> values = exact.at(covered, progress);
  std::size_t next = 0;
  for (auto& probe : probes) {
    if (!probe.covered) continue;
    probe.value = values[next++];
    probe.bound = 0;
  }
  return probes;
}

std::vector<Probe> probe_d2vr(const std::filesystem::path& path, const Arguments& args,
                              const std::vector<Vec3>& points, const Progress& progress) {
  D2vrOptions options;
  options.field = field_options(args);
  options.upsampling = upsampling_option(args);
  const ProjectionSet scan = load_scan(path, args, options.field, progress);
  Device device = open_device(common_options(args));
  const D2vrField field(device, scan, options, progress);
  std::vector<Probe> probes(points.size());
  std::vector<Vec3> covered;
  for (std::size_t i = 0; i < points.size(); ++i)
    if ((probes[i].covered = field.covered(points[i]))) covered.push_back(points[i]);
  const std::vector<float> values = field.at(covered, progress);
  std::size_t next = 0;
  for (auto& probe : probes)
    if (probe.covered) probe.value = static_cast<double>(values[next++]);
  return probes;
}

}  // namespace

int probe_command(Arguments& args) {
  args.positional("FILE", "a certified volume, a volume, or projections")
      .value("points", "P.csv", "points, with the header x,y,z")
      .value(
          "output,o", "V.csv",
          "x,y,z,value,bound,level,covered, and sigma of F where the file has it; empty where not covered, "
          "bound also where not certified")
      .flag("exact", "of projections: the field F in double precision on the host")
      .value("like", "OUT.vdvr", "with --exact: take the field options from this file")
      .value("projections", "IN", "of a certified volume from elsewhere: where the covered points are");
  args.value(
          "method", "vdvr|d2vr",
          "d2vr: of projections what a ray of D2VR takes, bilinear between detector samples (default vdvr)")
      .value("upsampling", "N",
             "with --method d2vr: columns and rows per detector pixel, a power of two (default 1)");
  add_scan(args);
  add_volume_input(args);
  add_field(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const bool d2vr = args.choice("method", "vdvr") == "d2vr";
  if (d2vr) refuse(args, {"exact", "like"}, "excludes --method d2vr, which is another field than F");
  else refuse(args, {"upsampling"}, "applies to --method d2vr");
  const auto path = args.path("FILE"), points_path = args.path("points"), output = args.path("output");
  check_output(output, common.force, {path, points_path});
  const InputKind kind = kind_of(path, args);
  if (kind != InputKind::scan) {
    refuse(args, {"exact", "like", "angles-file"}, path.string() + " is not a projection set");
    if (kind == InputKind::volume || !args.has("projections"))
      refuse(args, {"beam"}, path.string() + " is not a projection set");
    if (d2vr) refuse(args, {"method"}, path.string() + " is not a projection set");
    refuse(args,
           {"center", "filter", "filter-cutoff", "outliers", "phase", "stripes", "median", "gaussian",
            "binning"},
           "defines the field of projections; " + path.string() + " has its own");
  }
  if (kind != InputKind::certified)
    refuse(args, {"projections"}, path.string() + " is not a certified volume; leave it out");
  const std::vector<Vec3> points = read_points(points_path);

  ProgressLine progress(args.who(), common.quiet);
  bool sigma = false;
  const std::vector<Probe> probes = kind == InputKind::certified
                                        ? probe_certified(path, args, points, sigma, progress.callback())
                                    : kind == InputKind::volume ? probe_volume(path, args, points)
                                    : d2vr ? probe_d2vr(path, args, points, progress.callback())
                                           : probe_exact(path, args, points, progress.callback());
  throw_if_stopped();
  io::write_file(output, to_csv(points, probes, sigma));
  progress.clear();
  const auto covered = std::count_if(probes.begin(), probes.end(), [](const Probe& p) { return p.covered; });
  print_result(common, {{"output", output.string()}, {"points", points.size()}, {"covered", covered}}, [&] {
    fmt::print("{}: {} points, {} of them covered\n", output.string(), points.size(), covered);
  });
  return 0;
}

}  // namespace vdvr::cli
