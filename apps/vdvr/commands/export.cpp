// vdvr export: a uniform volume from a certified one, for programs that know nothing of bricks.
#include <fmt/format.h>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/volume_file.hpp"

namespace vdvr::cli {
namespace {

Grid finer(const Grid& grid, int oversampling) {
  Grid result = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    result.cells[a] *= oversampling;
    result.spacing[a] /= oversampling;
  }
  return result;
}

/// The field on every sample of `grid`. Cost: one host sample each.
Volume sample_all(const MixedVolume& source, const Grid& grid, std::uint64_t max_memory,
                  const Progress& progress) {
  // In double: oversampling multiplies the count by up to 512, which may pass 2^63 for a hostile file.
  double bytes = sizeof(float);
  for (const auto cells : grid.cells) bytes *= static_cast<double>(cells) + 1;
  const double limit = max_memory == 0 ? 0x1p40 : static_cast<double>(max_memory);
  if (bytes > limit)
    throw ResourceError(
        fmt::format("the exported volume needs {:.1f} MiB; raise --max-memory or lower --oversampling",
                    bytes / (1 << 20)));
  Volume volume{grid, {}};
  volume.samples.reserve(static_cast<std::size_t>(grid.sample_count()));
  const Index3 n = grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z) {
    report(progress, "export", static_cast<double>(z) / static_cast<double>(n[2]));
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x)
        volume.samples.push_back(sample_at(source, grid.position({x, y, z})));
  }
  return volume;
}

}  // namespace

int export_command(Arguments& args) {
  args.positional("FILE", "the certified volume")
      .value("output,o", "VOL.mha|.nrrd", "the uniform volume to write")
      .value("oversampling", "1|2|4|8", "samples per base cell and axis (default 1)")
      .flag("unverified", "export although content and certificate do not match");
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const int oversampling = std::stoi(args.choice("oversampling", {"1", "2", "4", "8"}, "1"));
  const auto path = args.path("FILE"), output = args.path("output");
  if (!is_volume_path(output))
    throw InputError(fmt::format("{}: write a volume as .mha or .nrrd", output.string()));
  check_output(output, common.force, {path});
  if (kind_of(path, args) != InputKind::certified)
    throw InputError(fmt::format("{}: is not a certified volume", path.string()));

  ProgressLine progress(args.who(), common.quiet);
  const VdvrFile file = open_certified(path, args, args.has("unverified"));
  const Grid grid = finer(file.volume.grid, oversampling);
  const Volume volume = sample_all(file.volume, grid, common.max_memory, progress.callback());
  throw_if_stopped();
  write_volume(output, volume);
  progress.clear();
  print_result(common,
               {{"output", output.string()}, {"oversampling", oversampling}, {"grid", grid_json(grid)}}, [&] {
                 print_grid(grid);
                 fmt::print("written        {}\n", output.string());
               });
  return 0;
}

}  // namespace vdvr::cli
