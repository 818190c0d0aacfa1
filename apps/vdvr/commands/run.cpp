// vdvr run: plan, build, verify, render: everything a user wants from a scan, with defaults that work.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/certify.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/overlay.hpp"
#include "apps/vdvr/report.hpp"
#include "apps/vdvr/verification.hpp"
#include "apps/vdvr/view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/framing.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/safe_sampler.hpp"

namespace vdvr::cli {
namespace {

constexpr std::int64_t kPictureSide = 768;

/// Everything `run` has made, for the summary.
struct Outcome {
  Planned planned;
  BuildResult built;
  VerifyResult verified;
  ErrorSlice error;
  std::optional<MeasuredByRun> measured;
  std::string sampler, sampler_reason;
  std::vector<std::pair<std::string, std::string>> files;  ///< name and what it shows
  std::map<std::string, std::string> outside;              ///< of a picture: what no certificate covers
  std::map<std::string, double> seconds;
};

std::vector<std::string> file_names() {
  return {"volume.vdvr",    "dvr.png",     "bound.png",       "iso.png",   "slice-x.png",
          "slice-y.png",    "slice-z.png", "error.png",       "noise.png", "measured.png",
          "components.png", "report.html", "certificate.json"};
}

/// Of the slice through the node that errs most. Nodes around what is covered are tested too, and a slice
/// beside it shows nothing: it lies inside by more than rounding.
double height_of_worst(const Certificate& c) {
  if (!c.covered) return c.worst_at[2];
  const auto& [low, high] = c.covered->z;
  const double inside = 1e-3 * (high - low);
  return std::clamp(c.worst_at[2], low + inside, high - inside);
}

/// Where the noise is known: the bounds in its units, on the error picture's slice.
void draw_noise(const OutputFolder& folder, Outcome& out) {
  const Certificate& c = out.built.certificate;
  if (!c.noise) return;
  const ErrorSlice slice =
      bound_slice(out.built.volume, c, false, {2, height_of_worst(c), kPictureSide, kPictureSide},
                  BrickQuantity::bound_in_sigma);
  write_png(folder.file("noise.png"), slice.image);
  out.files.emplace_back("noise.png",
                         "how far samples can lie from F there, in sigma of the scan's own noise");
}

/// The error slice and its picture lie across z through the dense part: there the interpolation errs
/// most.
void draw_pictures(Device& device, const OutputFolder& folder, Outcome& out, const Progress& progress) {
  const MixedVolume& volume = out.built.volume;
  const Brightness bright = brightness_of(volume);
  const ResidentVolume resident(device, volume);
  Renderer renderer(device, resident);
  RenderOptions o;
  o.width = o.height = kPictureSide;
  const SafeSampler safe = safe_sampler(device, volume, out.built.certificate);
  o.sampler = safe.sampler;
  o.gradient = GradientKind::automatic;
  o.transfer = two_material_transfer(bright);
  o.surfaces = {{bright.threshold}};
  o.slice_range = std::pair{bright.grey_lo, bright.grey_hi};
  const auto draw = [&](const std::string& name, const std::string& what) {
    report(progress, "render", 0);
    RenderOptions drawn = o;
    const bool slice = o.mode == RenderMode::slice;
    const SliceFrame frame = frame_of_slice(o, volume.grid, out.built.certificate);
    if (slice) {
      const SlicePlace place = slice_place(frame, o.width, o.height);
      drawn.width = place.width;
      drawn.height = place.height;
    }
    const RenderResult r = renderer.render(drawn);
    write_png(folder.file(name), slice ? framed_slice(frame, r.image, o.width, o.height) : r.image);
    out.files.emplace_back(name, what);
    out.outside[name] = outside_certificate(o);
    out.sampler = sampler_name(r.sampler);
    out.sampler_reason = safe.reason.empty() ? r.sampler_reason : safe.reason;
  };

  // Of a volume of a cell or two in z only slices across z show anything: there the object fills the picture.
  const bool thin = is_thin(volume.grid);
  if (!thin) {
    o.mode = RenderMode::dvr;
    o.step_mode = StepMode::adaptive;
    o.camera = orbit_camera(frame_view(volume, o, 40, 15), 40, 15, 1);
    draw("dvr.png", "direct volume rendering");
    RenderOptions bound = o;
    bound.output = RenderOutput::error;
    bound.height -= kErrorCaption;
    renderer.set_bounds(brick_bounds(*safe.certificate, out.sampler == "image3d"));
    write_png(folder.file("bound.png"),
              bound_picture(renderer.render(bound).values, out.built.certificate.epsilon_abs));
    out.files.emplace_back("bound.png", "how far the samples behind each pixel of dvr.png can lie from F");
    o.mode = RenderMode::iso;
    o.camera = orbit_camera(frame_view(volume, o, 40, 15), 40, 15, 1);
    draw("iso.png", fmt::format("iso-surface at {:.4g}", bright.threshold));
  }
  o.mode = RenderMode::slice;
  for (int axis = thin ? 2 : 0; axis < 3; ++axis) {
    o.slice_axis = axis;
    o.slice_position = bright.dense_center[static_cast<std::size_t>(axis)];
    draw(fmt::format("slice-{}.png", "xyz"[axis]),
         fmt::format("slice at {} = {:.4g}, through the dense part", "xyz"[axis], *o.slice_position));
  }
  if (thin) {
    // Gradients of a slab of two samples are noise.
    o.mode = RenderMode::dvr;
    o.step_mode = StepMode::adaptive;
    o.shading = false;
    o.camera = orbit_camera(frame_view(volume, o, 0, 89), 0, 89, 1);
    draw("dvr.png", "direct volume rendering without light, nearly along the axis");
  }
  const double height = height_of_worst(out.built.certificate);
  out.error = error_slice(device, out.planned.scan, volume, out.built.certificate,
                          {2, height, kPictureSide, kPictureSide}, progress);
  write_png(folder.file("error.png"), out.error.image);
  out.files.emplace_back("error.png", fmt::format("|V - F| on the slice at z = {:.4g}", height));
  draw_noise(folder, out);
}

/// On the slice through the dense part.
void draw_measured(const OutputFolder& folder, Outcome& out, const Progress& progress) {
  if (!out.measured) return;
  MeasuredByRun& m = *out.measured;
  measure_for_run(m, out.built.volume, out.built.certificate, brightness_of(out.built.volume).dense_center[2],
                  kPictureSide, folder, progress);
  if (!m.why_not.empty()) return;
  out.files.emplace_back("measured.png", fmt::format("where {}: surely, possibly (striped), or not", m.what));
  out.files.emplace_back("components.png", "separate places of it, each in a colour");
}

std::string bytes_of(const std::filesystem::path& path) {
  std::string bytes(std::filesystem::file_size(path), '\0');
  std::ifstream in(path, std::ios::binary);
  if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    throw FileError(fmt::format("{}: cannot be read again", path.string()));
  return bytes;
}

/// The words that measure the certificate again; verify takes the field from the file.
std::vector<std::string> verify_words(const Arguments& args, const OutputFolder& folder) {
  std::vector<std::string> words{"vdvr",          "verify",        folder.file("volume.vdvr").string(),
                                 "--projections", args.text("IN"), "--exhaustive"};
  for (const std::string option : {"angles-file", "beam"})
    if (args.has(option)) words.insert(words.end(), {"--" + option, args.text(option)});
  // verify measures on one.
  if (const std::string one = first_device(args); !one.empty()) words.insert(words.end(), {"--device", one});
  return words;
}

/// The `run` line without what belongs to that one run.
std::vector<std::string> run_words(const Arguments& args) {
  std::vector<std::string> words{"vdvr", "run"};
  std::copy_if(args.words().begin(), args.words().end(), std::back_inserter(words),
               [](const std::string& word) { return word != "--resume" && word != "--quiet"; });
  return words;
}

void write_report(const Device& device, const Arguments& args, const OutputFolder& folder, Outcome& out) {
  RunReport page{out.planned.scan, out.built.volume, out.built.certificate, out.verified, out.error};
  page.sampler = out.sampler;
  page.sampler_reason = out.sampler_reason;
  page.device = device.info();
  for (const std::string stage : {"plan", "build", "verify", "pictures"})
    page.seconds.emplace_back(stage, out.seconds.at(stage));
  page.build_seconds = out.built.seconds;
  page.file_bytes = std::filesystem::file_size(folder.file("volume.vdvr"));
  for (const auto& [name, caption] : out.files) {
    if (!name.ends_with(".png")) continue;
    const auto outside = out.outside.find(name);
    page.pictures.push_back(
        {name, caption, outside == out.outside.end() ? "" : outside->second, bytes_of(folder.file(name))});
  }
  page.measured = out.measured;
  page.run_words = run_words(args);
  page.verify_words = verify_words(args, folder);
  io::write_file(folder.file("report.html"), report_page(page));
  out.files.emplace_back("report.html", "all of this on one page");
}

Json outcome_json(const std::filesystem::path& folder, const Outcome& out, std::uint64_t file_bytes) {
  Json files = Json::object();
  for (const auto& [name, what] : out.files) files[name] = what;
  return {
      {"measured", out.measured ? measured_json(*out.measured) : Json()},
      {"output", folder.string()},
      {"files", files},
      {"outside_certificate", out.outside},
      {"geometry", geometry_json(out.planned.scan.geometry)},
      {"understood", understood_json(out.planned.scan, out.planned.understood)},
      {"report", report_json(out.planned.scan.report)},
      {"grid", grid_json(out.built.volume.grid)},
      {"bricks", levels_json(out.built.volume)},
      {"storage", storage_json(out.built.volume, file_bytes)},
      {"verification", verification_json(out.verified, out.built.certificate)},
      {"error_slice",
       {{"max_error", out.error.max_error}, {"worst_at", out.error.worst_at}, {"pixels", out.error.pixels}}},
      {"sampler", {{"used", out.sampler}, {"reason", out.sampler_reason}}},
      {"seconds", seconds_json(out.seconds)},
      {"build_seconds", seconds_json(out.built.seconds)},
      {"certificate", certificate_json(out.built.certificate)}};
}

void print_outcome(const std::filesystem::path& folder, const Outcome& out, std::uint64_t file_bytes) {
  const Certificate& c = out.built.certificate;
  print_grid(out.built.volume.grid);
  print_certificate(c);
  print_verification(out.verified, c);
  fmt::print("error slice    largest |V - F| on {} pixels: {:.4g}, {:.1f} % of the tolerance\n",
             out.error.pixels, out.error.max_error, 100 * out.error.max_error / c.epsilon_abs);
  if (out.measured)
    for (const std::string& line : measured_lines(*out.measured, out.built.volume.grid.unit))
      fmt::print("{}\n", line);
  print_storage(out.built.volume, file_bytes);
  fmt::print("rendered with  {} ({})\n", out.sampler, out.sampler_reason);
  print_seconds(out.seconds);
  fmt::print("files in       {}\n", folder.string());
  for (const auto& [name, what] : out.files) fmt::print("    {:<18} {}\n", name, what);
  fmt::print("pictures       show samples within {:.4g} of F; beyond that ", c.epsilon_abs);
  const auto dvr = out.outside.find("dvr.png");
  fmt::print("{}\n", dvr == out.outside.end() ? "" : dvr->second);
}

int run_steps(const Arguments& args, const CommonOptions& common, Wanted wanted,
              const std::filesystem::path& output, OutputFolder& folder, Journals& journals) {
  Devices devices(args, common);
  Device& device = devices.first();
  wanted.options.build.crew = devices.crew();
  ProgressLine line(args.who(), common.quiet);
  const Progress progress = line.callback();
  Outcome out;
  out.measured = asked_to_measure(args);
  // What was understood comes first: whoever sees that it is wrong need not wait for the rest.
  const auto show = [&](const Planned& read) {
    line.clear();
    if (common.json || common.quiet) return;
    print_scan(read.scan, &read.understood);
    if (!read.chosen.empty()) fmt::print("tolerance      {}\n", read.chosen);
    std::fflush(stdout);
  };
  out.planned =
      timed(out.seconds, "plan", [&] { return read_and_plan(device, args, wanted, progress, show); });
  out.built =
      timed(out.seconds, "build", [&] { return build_planned(device, out.planned, wanted, progress); });
  const Certificate& certificate = out.built.certificate;
  out.verified = timed(out.seconds, "verify", [&] {
    return verify(device, out.planned.scan, out.built.volume, certificate, {}, progress);
  });
  if (!out.verified.holds)
    throw MismatchError(fmt::format("the certificate is not confirmed: {}", out.verified.failure));
  throw_if_stopped();

  folder.begin();
  write_vdvr(folder.file("volume.vdvr"), out.built.volume, certificate, wanted.compression);
  out.files.emplace_back("volume.vdvr", "the certified volume");
  timed(out.seconds, "pictures", [&] {
    draw_pictures(device, folder, out, progress);
    draw_measured(folder, out, progress);
    return 0;
  });
  if (!(out.error.max_error <= certificate.epsilon_abs))
    throw MismatchError(fmt::format("the error slice shows {:.6g}, above epsilon {:.6g}", out.error.max_error,
                                    certificate.epsilon_abs));
  throw_if_stopped();
  write_report(device, args, folder, out);
  folder.finish(to_json(certificate));
  journals.remove();
  out.files.emplace_back("certificate.json", "what is promised, and by which argument");
  line.clear();

  const std::uint64_t bytes = std::filesystem::file_size(folder.file("volume.vdvr"));
  print_result(common, outcome_json(output, out, bytes), [&] { print_outcome(output, out, bytes); });
  return std::max(pictures_exit_code(args.who(), out.planned),
                  certificate_exit_code(args.who(), certificate));
}

}  // namespace

int run_command(Arguments& args) {
  args.positional("IN", "projections")
      .value("output,o", "DIR", "the folder for volume, pictures, report.html and certificate");
  add_certify_options(args);
  add_measured(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  Wanted wanted = wanted_to_certify(args, true);
  if (wanted.options.plan.comparison.is_never_certified())
    throw InputError("--terms grid, --closing none and --paper make volumes for comparison: use vdvr build");
  asked_to_measure(args);
  const auto output = args.path("output"), volume = output / "volume.vdvr";
  kind_of(args.path("IN"), args);
  OutputFolder folder(output, file_names(), common.force || continues(args, volume));
  std::vector<std::filesystem::path> outputs;
  for (const auto& name : file_names()) outputs.push_back(folder.file(name));
  Journals journals = open_journals(args, common, volume, outputs);
  journals.name_in(wanted.options.build);
  return resumable(*journals.own, [&] { return run_steps(args, common, wanted, output, folder, journals); });
}

}  // namespace vdvr::cli
