// vdvr serve: a volume in the browser, to be turned with the mouse.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/serve/server.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/live_json.hpp"
#include "vdvr/expert/live_renderer.hpp"
#include "vdvr/expert/stop.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr::cli {
namespace {

/// "127.0.0.1", "127.3.2.1" or "::1".
bool is_loopback(const std::string& address) { return address.rfind("127.", 0) == 0 || address == "::1"; }

ServerOptions server_options(const Arguments& args) {
  ServerOptions o;
  o.address = args.text_or("address", o.address);
  if (o.address == "localhost") o.address = "127.0.0.1";
  o.port = static_cast<int>(args.integer_or("port", 0, 0, 65535));
  o.names = {"localhost"};
  for (const std::string& name : args.texts("name")) {
    const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '.' || c == '-';
    });
    if (name.empty() || !plain)
      throw InputError(fmt::format("--name: {} is not a host's name; write it without port", name));
    o.names.push_back(name);
  }
  return o;
}

/// What the certificate says, in words.
Json certificate_words(const Scene& scene, const DeviceTest& test) {
  Json lines = Json::array();
  if (!test.passed())
    lines.push_back(
        "The device that draws failed its test: nothing below is said of these pictures. It errs in " +
        test.failures() + ".");
  if (!scene.certificate || scene.certificate->comparison) {
    lines.push_back("This volume has no certificate: nothing says how far it lies from what was measured.");
    return lines;
  }
  const Certificate& c = *scene.certificate;
  if (!scene.verified)
    lines.push_back(
        "Content and certificate were not compared (--unverified): nothing below can be relied on.");
  const bool holds = c.holds_buffer;
  lines.push_back(fmt::format(
      "{} At every covered point the volume lies within {:.4g}{} of F, what filtered back-projection of "
      "the projections says with ideal interpolation. That is {:.3g} % of the range of F.",
      holds ? "The certificate holds." : "The certificate does not hold for the buffer sampler.",
      c.epsilon_abs, scene.volume.grid.unit.empty() ? "" : " per " + scene.volume.grid.unit,
      100 * c.epsilon));
  lines.push_back(fmt::format("The largest bound found is {:.4g}, {:.3g} % of that tolerance.",
                              c.total_buffer, 100 * c.total_buffer / c.epsilon_abs));
  if (c.not_covered_count > 0)
    lines.push_back(fmt::format("{:.3g} % of the samples are not covered: some view does not see them.",
                                100 * c.not_covered_fraction));
  lines.push_back(
      "Not certified: noise, too few views, scattering or motion, which shape F itself; colours, light and "
      "the "
      "step along a ray; pictures while they move, which are coarser and JPEG.");
  for (const std::string& note : c.notes) lines.push_back(note);
  return lines;
}

std::string scene_json(const std::filesystem::path& path, const Scene& scene, const DeviceTest& test,
                       const LiveScene& live) {
  Json json = Json::parse(to_json(live));
  json["file"] = path.filename().string();
  json["version"] = VDVR_VERSION;
  json["words"] = certificate_words(scene, test);
  json["first"] = Json::parse(to_json(first_state(live, 512, 512)));
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

int serve_command(Arguments& args) {
  args.positional("FILE", "a certified volume, or a uniform one: MHA, NRRD, FILE.h5:/dataset, TIFF slices")
      .value("address", "IP",
             "listen at this address (default 127.0.0.1, this machine alone; 0.0.0.0: every one it has)")
      .value("port", "N", "1 to 65535 (default: one that is free)")
      .values("name", "HOST",
              "a name by which browsers may call this machine, beside addresses and localhost; may be given "
              "several times")
      .flag("unverified", "show although content and certificate do not match");
  add_volume_input(args);
  add_untrusted(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  untrusted_option(args);
  ServerOptions options = server_options(args);
  const auto path = args.path("FILE");

  ProgressLine progress(args.who(), common.quiet);
  const Scene scene = open_scene(path, args, "vdvr", args.has("unverified"));
  Device device = open_device(common);
  LiveRenderer renderer(device, scene.volume, scene.certificate);
  options.scene = scene_json(path, scene, test_of(device), renderer.scene());
  Server server(renderer, options);
  progress.clear();
  throw_if_stopped();
  if (!is_loopback(options.address))
    say(fmt::format(
        "{}: anyone who can reach {} and learns the address below sees this volume; the connection "
        "is not encrypted\n",
        args.who(), options.address));
  const Json json = {{"address", server.address()}, {"port", server.port()}, {"file", path.string()}};
  print_result(common, json, [&] {
    fmt::print(
        "{}: open\n  {}\nin a browser. The address is the key: who has it sees the volume. Ctrl-C ends.\n",
        path.string(), server.address());
  });
  std::fflush(stdout);
  server.run();
  throw Interrupted(stop_requested(), "ended");
}

}  // namespace vdvr::cli
