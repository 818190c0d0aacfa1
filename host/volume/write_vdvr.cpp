// Writes the .vdvr file (docs/file-format.md), whole or not at all.
#include <fmt/format.h>

#include <span>

#include "host/files/hdf5/hdf5_writer.hpp"
#include "host/volume/seal.hpp"
#include "host/volume/validate_volume.hpp"
#include "host/volume/vdvr_file.hpp"
#include "host/volume/vdvr_layout.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {
namespace {

namespace h5 = io::hdf5;

// Of zlib's nine: within 1.5 % of the smallest on real volumes, at half the time of 6 (docs/file-format.md).
constexpr unsigned deflate_level = 4;

void write_grid(h5::Writer& file, const MixedVolume& v) {
  file.group("/grid");
  file.attribute("/grid", "cells", zyx(v.grid.cells));
  file.attribute("/grid", "origin", zyx(v.grid.origin));
  file.attribute("/grid", "spacing", zyx(v.grid.spacing));
  file.attribute("/grid", "unit", v.grid.unit);
  file.attribute("/grid", "granularity", std::int64_t{v.granularity});
  file.attribute("/grid", "rate", std::int64_t{v.rate});
  if (is_coarse(v)) file.attribute("/grid", "coarsening", wide(v.coarsening));
}

void write_index(h5::Writer& file, const MixedVolume& v) {
  const Index3 b = v.bricks();
  static_assert(sizeof(LevelTriple) == 3);
  file.dataset("/level", shape_of({b[2], b[1], b[0], 3}),
               std::span<const std::uint8_t>(v.level.data()->data(), 3 * v.level.size()));
  file.dataset("/tile", shape_of({b[2], b[1], b[0]}), std::span<const std::uint32_t>(v.tile));
}

/// Samples, and offset and shift of each tile where they are integers.
void write_block(h5::Writer& file, const std::string& path, const h5::Shape& shape, const SampleBlock& b) {
  if (b.type == SampleType::f32) file.dataset(path, shape, std::span<const float>(b.f32));
  else if (b.type == SampleType::u16) file.dataset(path, shape, std::span<const std::uint16_t>(b.u16));
  else file.dataset(path, shape, std::span<const std::uint8_t>(b.u8));
  if (b.type == SampleType::f32) return;
  if (path == "/base") {
    file.attribute(path, "offset", std::int64_t{b.offset.front()});
    file.attribute(path, "shift", std::int64_t{b.shift.front()});
    return;
  }
  file.dataset(path + "_offset", {b.offset.size()}, std::span<const std::int32_t>(b.offset));
  file.dataset(path + "_shift", {b.shift.size()}, std::span<const std::uint8_t>(b.shift));
}

void write_by_brick(h5::Writer& file, const char* name, const MixedVolume& v,
                    const std::vector<float>& values) {
  const Index3 b = v.bricks();
  if (values.size() != v.level.size())
    throw InputError(
        fmt::format("not written: {}: {} values for {} bricks", name, values.size(), v.level.size()));
  file.dataset(name, shape_of({b[2], b[1], b[0]}), std::span<const float>(values));
}

}  // namespace

void write_vdvr(const std::filesystem::path& path, const MixedVolume& v, const Certificate& certificate,
                Compression compression) {
  if (const auto p = validate_volume(v))
    throw InputError(fmt::format("{}: not written: {}: {}", path.string(), p->where, p->what));
  Certificate stored = certificate;
  if (stored.content_sha256.empty()) stored.content_sha256 = content_sha256(v);
  stored.sealed = true;
  const std::string json = to_json(stored);

  io::AtomicFile target(path);
  {
    h5::Writer file(target.temporary(), path,
                    {.deflate_level = compression == Compression::deflate ? deflate_level : 0});
    file.attribute("/", "format", std::string("vdvr"));
    file.attribute("/", "format_version",
                   std::int64_t{is_coarse(v)      ? 4
                                : has_parts(v)    ? 3
                                : has_integers(v) ? 2
                                                  : 1});
    file.attribute("/", "generator", std::string("vdvr " VDVR_VERSION));
    if (has_integers(v)) file.attribute("/", "step", v.step);
    write_grid(file, v);
    write_block(file, "/base", base_shape(v), v.base);
    write_index(file, v);
    file.group("/tiles");
    for (const auto& [triple, samples] : v.tiles) {
      if (samples.size() == 0) continue;
      const auto side = v.tile_shape(triple);
      const auto count = static_cast<std::int64_t>(samples.size()) / v.tile_size(triple);
      write_block(file, path_of(triple), shape_of({count, side[0], side[1], side[2]}), samples);
    }
    if (stored.comparison) stored.brick_totals.clear();
    file.text(stored.comparison ? kComparison : kCertificate, json);
    if (!stored.brick_totals.empty()) write_by_brick(file, kTotals, v, stored.brick_totals);
    if (stored.noise) write_by_brick(file, kSigma, v, stored.brick_sigma);
    file.attribute("/", kSeal, seal_of(json, stored.brick_totals, file.attributes()));
    file.close();
  }
  target.commit();
}

}  // namespace vdvr
