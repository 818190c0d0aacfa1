// Sigma of F beside an exported volume. Declared in vdvr/export_volume.hpp.
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "vdvr/error.hpp"
#include "vdvr/export_volume.hpp"

namespace vdvr {

std::filesystem::path sigma_path(const std::filesystem::path& volume) {
  const std::filesystem::path file = volume.has_filename() ? volume : volume.parent_path();
  return file.parent_path() / (file.stem().string() + "-sigma" + file.extension().string());
}

ExportResult export_sigma(const VdvrFile& file, const std::filesystem::path& path, const Grid& grid,
                          const ExportOptions& options, const Progress& progress) {
  const std::vector<float>& sigma = file.certificate.brick_sigma;
  const MixedVolume& v = file.volume;
  if (sigma.size() != v.level.size())
    throw InputError("the certificate does not know the scan's noise: no sigma to export");
  ExportOptions one = options;
  one.oversampling = 1;
  one.samples = SampleType::f32;
  one.range.reset();
  const Index3 n = grid.samples(), bricks = v.bricks();
  UniformWriter writer(path, grid, one);
  std::vector<float> plane(at(n[0] * n[1]));
  for (std::int64_t z = 0; z < n[2]; ++z) {
    parallel_for(n[1], {}, "sigma", [&](std::int64_t y) {
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const Index3 b = brick_at(v, grid.position({x, y, z}));
        plane[at(y * n[0] + x)] = sigma[at((b[2] * bricks[1] + b[1]) * bricks[0] + b[0])];
      }
    });
    writer.append(plane);
    report(progress, "sigma", static_cast<double>(z + 1) / static_cast<double>(n[2]));
  }
  return writer.commit();
}

}  // namespace vdvr
