// vdvr devices: platforms, devices, limits, which sampler and why.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/vdvr/command.hpp"
#include "apps/vdvr/doctor.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/trust.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {
namespace {

/// Which samplers a device can have, from its queries alone.
std::string sampler_reason(const DeviceInfo& d) {
  if (!d.images) return "buffer: the device has no images";
  if (!d.linear_float_image) return "buffer: no CL_R/CL_FLOAT 3D image format";
  return "buffer or image3d: CL_R/CL_FLOAT 3D images exist; --probe measures which is faster and how exact "
         "it is";
}

Json device_json(const DeviceInfo& d) {
  return {{"index", d.index},
          {"platform", d.platform},
          {"name", d.name},
          {"vendor", d.vendor},
          {"version", d.version},
          {"driver", d.driver},
          {"type", d.is_gpu   ? "gpu"
                   : d.is_cpu ? "cpu"
                              : "other"},
          {"compute_units", d.compute_units},
          {"global_memory", d.global_memory},
          {"max_allocation", d.max_allocation},
          {"local_memory", d.local_memory},
          {"max_work_group", d.max_work_group},
          {"images", d.images},
          {"linear_float_image", d.linear_float_image},
          {"linear_u16_image", d.linear_u16_image},
          {"linear_u8_image", d.linear_u8_image},
          {"image3d_max", {d.image3d_max[0], d.image3d_max[1], d.image3d_max[2]}},
          {"sampler", sampler_reason(d)}};
}

Json filter_json(const FilterProbe& p) {
  return {{"image3d", p.image3d},
          {"weight_error", p.weight_error},
          {"delta", p.delta},
          {"constant_error", p.constant_error}};
}

Json probe_json(const SamplerProbe& p) {
  return {{"image3d", p.image3d},
          {"f32", filter_json(p)},
          {"u16", filter_json(p.u16)},
          {"u8", filter_json(p.u8)},
          {"weight_error", p.weight_error},
          {"delta", p.delta},
          {"constant_error", p.constant_error},
          {"buffer_samples_per_second", p.buffer_rate},
          {"image3d_samples_per_second", p.image3d_rate},
          {"chosen", p.chosen}};
}

/// A filter's line: what it does to weights and to what is the same all around.
std::string filter_text(const Json& p) {
  if (!p["image3d"].get<bool>()) return "no 3D image that can be read with the linear filter";
  return fmt::format("weights off by {:.3g}, charged {:.3g}; constants off by {:.3g}",
                     p["weight_error"].get<double>(), p["delta"].get<double>(),
                     p["constant_error"].get<double>());
}

/// What a device was asked when it was opened.
void add_test(Json& entry, const DeviceTest& test) {
  Json checks = Json::array();
  for (const DeviceCheck& check : test.checks)
    checks.push_back({{"name", check.name}, {"passed", check.found.empty()}, {"found", check.found}});
  entry["test"] = {{"passed", test.passed()},
                   {"remembered", test.remembered},
                   {"seconds", test.seconds},
                   {"checks", checks}};
}

void print_test(const Json& d) {
  const Json& test = d["test"];
  fmt::print("  test         {}{}\n",
             test["passed"].get<bool>() ? "passed" : "failed: nothing is certified with it",
             test["remembered"].get<bool>() ? ", remembered" : "");
  for (const Json& check : test["checks"])
    fmt::print("    {:<18} {}\n", check["name"].get<std::string>(),
               check["passed"].get<bool>() ? "as it should be" : check["found"].get<std::string>());
}

void print_device(const Json& d) {
  const auto text = [&](const char* key) { return d[key].get<std::string>(); };
  const auto memory = [&](const char* key) { return bytes_text(d[key].get<std::uint64_t>()); };
  fmt::print("{}: {} ({}, {})\n", d["index"].get<int>(), text("name"), text("type"), text("platform"));
  if (d.contains("trouble")) {
    fmt::print("  cannot be used: {}\n", text("trouble"));
    return;
  }
  fmt::print("  version      {}, driver {}\n", text("version"), text("driver"));
  fmt::print("  compute      {} units, work-groups up to {}\n", d["compute_units"].get<int>(),
             d["max_work_group"].get<int>());
  fmt::print("  memory       {} global, {} in one allocation, {} local\n", memory("global_memory"),
             memory("max_allocation"), memory("local_memory"));
  fmt::print("  image3d      up to {}\n", d["image3d_max"].dump());
  fmt::print("  sampler      {}\n", text("sampler"));
  if (d.contains("test")) print_test(d);
  if (!d.contains("probe")) return;
  const Json& p = d["probe"];
  fmt::print("  probe        {} chosen; buffer {:.4g} samples/s", p["chosen"].get<std::string>(),
             p["buffer_samples_per_second"].get<double>());
  if (p["image3d"].get<bool>())
    fmt::print(", image3d {:.4g} samples/s", p["image3d_samples_per_second"].get<double>());
  fmt::print("\n");
  for (const char* type : {"f32", "u16", "u8"}) fmt::print("  filter {:<6}{}\n", type, filter_text(p[type]));
  if (d.contains("cube")) fmt::print("  cube         {}\n", cube_text(d["cube"]));
}

void add_probe(Json& entry, Device& device) {
  add_test(entry, test_of(device));
  entry["probe"] = probe_json(probe_sampler(device));
  if (test_of(device).passed()) entry["cube"] = certified_cube(device);
}

/// What cannot be opened is shown with the reason, beside the others.
Json listed_json(const ListedDevice& listed, bool probe, const CommonOptions& common) {
  Json entry = device_json(listed.info);
  std::string trouble = listed.trouble;
  if (probe && trouble.empty()) {
    try {
      Device device(std::to_string(listed.info.index), common.max_memory);
      add_probe(entry, device);
    } catch (const Error& e) {
      if (e.kind() != ErrorKind::device && e.kind() != ErrorKind::build) throw;
      trouble = e.what();
    }
  }
  if (!trouble.empty()) entry["trouble"] = trouble;
  return entry;
}

bool has_type(const Json& list, const char* type) {
  return std::any_of(list.begin(), list.end(),
                     [&](const Json& d) { return d["type"] == type && !d.contains("trouble"); });
}

}  // namespace

int devices_command(Arguments& args) {
  args.flag("probe",
            "what a machine lacks; test each device's arithmetic, measure its sampler's error and bandwidth, "
            "certify a small volume (of --device, or of all)");
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  open_untrusted_devices(true);  // it is here that one sees what failed
  Json list = Json::array();
  if (args.has("device")) {
    Device device = open_device(common);
    list.push_back(device_json(device.info()));
    if (args.has("probe")) add_probe(list.back(), device);
  } else {
    for (const ListedDevice& listed : describe_devices())
      list.push_back(listed_json(listed, args.has("probe"), common));
  }
  Json json{{"devices", list}};
  if (args.has("probe")) {
    const OpenClSetup setup = opencl_setup();
    json["setup"] = setup_json(setup, missing_drivers(setup, has_type(list, "cpu"), has_type(list, "gpu")));
  }
  print_result(common, json, [&] {
    if (json.contains("setup")) print_setup(json["setup"]);
    if (list.empty()) fmt::print("no OpenCL device; install one, for a CPU the package pocl-opencl-icd\n");
    for (const Json& entry : list) print_device(entry);
    if (json.contains("setup")) print_how_to_report();
  });
  return 0;
}

}  // namespace vdvr::cli
