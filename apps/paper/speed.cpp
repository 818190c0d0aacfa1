// Pictures per second of certified volumes, uniform ones and D2VR, object by object, in one run.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/paper/report.hpp"
#include "vdvr/error.hpp"

namespace vdvr::paper {

void measure_speeds(Report& run, const std::string& object, const TestScan& test, const Case& made,
                    const MixedVolume& uniform, const TransferFunction& transfer) {
  report(run.progress, "speed", 0);
  RenderOptions view = timing_view(test.grid);
  view.transfer = transfer;
  const int many = 4 * run.frames(), few = run.frames() / 2;
  std::vector<SpeedRow> rows;
  const auto time = [&](const std::string& method, std::uint64_t bytes, int frames, const auto& draw) {
    rows.push_back(
        {object, method, bytes, measure_speed(draw, view, test.grid, frames, run.progress), 1, std::nullopt});
  };
  const ResidentVolume mixed(run.device, made.volume), base(run.device, uniform);
  Renderer of_mixed(run.device, mixed), of_base(run.device, base);
  const auto draw_mixed = [&](const RenderOptions& o) { return draw_case(of_mixed, made, o); };
  time("VDVR (ours)", mixed.bytes(), many, draw_mixed);
  time("uniform DVR", base.bytes(), many, [&](const RenderOptions& o) { return of_base.render(o); });
  std::optional<double> d2vr;
  const GradientKind usual = view.gradient;
  for (const GradientKind gradient : {GradientKind::central, GradientKind::analytic}) {
    const D2vrField field(run.device, test.scan, {}, run.progress);
    const D2vrScene scene(run.device, field, test.grid, run.progress);
    Renderer of_scene(run.device, scene);
    view.gradient = gradient;
    time(gradient == GradientKind::central ? "D2VR" : "D2VR, gradient from the projections", field.bytes(),
         few, [&](const RenderOptions& o) { return of_scene.render(o); });
    if (!d2vr) d2vr = rows.back().speed.seconds_median;
  }
  view.gradient = usual;
  // Once more, so that a change of the machine's load shows.
  time("VDVR (ours), again", mixed.bytes(), many, draw_mixed);
  for (auto& row : rows) row.times_d2vr = *d2vr / row.speed.seconds_median;
  run.speeds.insert(run.speeds.end(), rows.begin(), rows.end());
}

void measure_lobb_speeds(Report& run, const Lobb& lobb) {
  const LobbCase* ours = lobb.find(Settings::ours, 0.03);
  if (!ours) throw InputError("the comparison of speeds needs the volume at 3 %");
  const MixedVolume uniform = as_mixed(lobb.uniform);
  const TransferFunction transfer = transfer_preset("marschner-lobb", 0, 1);
  measure_speeds(run, "Marschner-Lobb", lobb.test, ours->made, uniform, transfer);
  // What its projections cost where they are upsampled, and what errs less by it.
  const D2vrField fine(run.device, lobb.test.scan, {{}, 8}, run.progress),
      plain(run.device, lobb.test.scan, {}, run.progress);
  const D2vrScene scene(run.device, fine, lobb.test.grid, run.progress);
  Renderer of_scene(run.device, scene);
  RenderOptions view = timing_view(lobb.test.grid);
  view.transfer = transfer;
  SpeedRow row{"Marschner-Lobb", "D2VR, 8x upsampled", fine.bytes(), {}, 1, std::nullopt};
  row.speed = measure_speed([&](const RenderOptions& o) { return of_scene.render(o); }, view, lobb.test.grid,
                            2, run.progress);
  row.function = measure_error(d2vr_on(fine, lobb.lattice, run.progress), lobb.function);
  for (auto& r : run.speeds) {
    if (r.object != row.object) continue;
    if (r.method == "D2VR") {
      row.times_d2vr = r.speed.seconds_median / row.speed.seconds_median;
      r.function = measure_error(d2vr_on(plain, lobb.lattice, run.progress), lobb.function);
    }
    if (r.method == "VDVR (ours)") r.function = ours->function;
    if (r.method == "uniform DVR")
      r.function = measure_error(stored_on(uniform, lobb.lattice), lobb.function);
  }
  run.speeds.push_back(std::move(row));
}

void add_speeds(Report& run) {
  Section section{"VDVR against D2VR: pictures per second", {}, {}, {}, {}};
  section.paragraphs = {
      "512 x 512, step of a base cell, lit, early termination and empty-space skipping on for all, a turn "
      "about z; of each object the same transfer function, camera and light for "
      "every method. D2VR's gradients are central differences, as the volumes' are, unless it says "
      "otherwise. One run, one device."};
  Table table{"speed",
              "Methods in turn on one device",
              {"object", "method", "fps", "seconds a frame (least, median, most)", "samples / s",
               "MiB on the device", "RMS against the function", "times D2VR"},
              {}};
  Json list = Json::array();
  for (const SpeedRow& r : run.speeds) {
    table.rows.push_back({r.object, r.method, number(r.speed.fps),
                          fmt::format("{:.3g}, {:.3g}, {:.3g}", r.speed.seconds_min, r.speed.seconds_median,
                                      r.speed.seconds_max),
                          fmt::format("{:.3g}", r.speed.samples_per_second),
                          fmt::format("{:.2f}", static_cast<double>(r.bytes) / (1 << 20)),
                          r.function ? percent(r.function->rms) : "", fmt::format("{:.1f}", r.times_d2vr)});
    Json j = speed_json(r.speed);
    j["object"] = r.object;
    j["method"] = r.method;
    j["bytes"] = r.bytes;
    j["times_d2vr"] = r.times_d2vr;
    if (r.function) j["to_function"] = measure_json(*r.function);
    list.push_back(std::move(j));
  }
  section.tables.push_back(std::move(table));
  section.remarks = {
      "D2VR's cost is that of a sample times the number of views; a stored sample's is not. The ratio "
      "therefore grows with the views, and with what a view takes of the caches."};
  run.json["speed"] = list;
  run.sections.push_back(std::move(section));
}

}  // namespace vdvr::paper
