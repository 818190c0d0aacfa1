// Keeps picture, tables and distances between frames; finds which bricks can be leapt over.
#include "host/picture/render/frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "host/base/opencl/kernel.hpp"
#include "host/volume/sampler/resident_volume.hpp"
#include "shared/raycast_params.h"
#include "vdvr/error.hpp"

namespace vdvr {

using opencl::DeviceArray;

namespace {

/// By brick 0 where the transfer function may show something, else the stretch of it that its values lie in.
std::vector<std::uint8_t> empty_bricks(const DrawnField& v, const BakedTransfer& table, float slack) {
  std::vector<std::uint8_t> classes(v.ranges.size());
  std::transform(v.ranges.begin(), v.ranges.end(), classes.begin(),
                 [&](const cl_float2& r) { return table.stretch_of(r.s[0] - slack, r.s[1] + slack); });
  return classes;
}

/// By brick 1 and on how many surfaces it lies, 0 where a surface may pass.
std::vector<std::uint8_t> sides_of_surfaces(const DrawnField& v, const std::vector<float>& surfaces,
                                            float slack) {
  const auto side = [&](float value) {
    return std::count_if(surfaces.begin(), surfaces.end(), [&](float s) { return value >= s; });
  };
  std::vector<std::uint8_t> classes(v.ranges.size());
  std::transform(v.ranges.begin(), v.ranges.end(), classes.begin(), [&](const cl_float2& r) {
    // Twice the allowance: kernels add one more before they pass a cell.
    const auto lowest = side(r.s[0] - 2 * slack), highest = side(r.s[1] + 2 * slack);
    return static_cast<std::uint8_t>(lowest == highest ? 1 + lowest : 0);
  });
  return classes;
}

/// The guide of VDVR_BASE_FIRST. `empty`: by brick 0 where it may show something; nothing else counts.
std::vector<std::uint8_t> guide_of(const DrawnField& v, const std::vector<std::uint8_t>& empty, bool skip) {
  constexpr std::uint8_t kTile = 0, kEmpty = 1, kBase = 2;
  std::vector<std::uint8_t> classes(empty.size());
  for (std::size_t i = 0; i < classes.size(); ++i)
    classes[i] = skip && empty[i] != 0 ? kEmpty : v.has_tile[i] != 0 ? kTile : kBase;
  const Index3 n{v.bricks.bricks_x, v.bricks.bricks_y, v.bricks.bricks_z};
  std::vector<std::uint8_t> guide = distance_to_other(classes, n);
  for (std::size_t i = 0; i < guide.size(); ++i) {
    guide[i] = std::min<std::uint8_t>(guide[i], VDVR_GUIDE_EMPTY - 1);
    if (classes[i] == kEmpty) guide[i] = static_cast<std::uint8_t>(guide[i] + VDVR_GUIDE_EMPTY);
  }
  return guide;
}

}  // namespace

const BakedTransfer& Frame::prepare(const RenderOptions& o, float slack, bool base_first) {
  fit_picture(o);
  static const BakedTransfer none;
  if (o.mode == RenderMode::slice) return none;
  bake_table(o);
  if (o.mode == RenderMode::dvr || o.mode == RenderMode::iso) update_distance(o, slack, base_first);
  return baked_;
}

void Frame::set_bounds(std::span<const float> bounds) {
  if (bounds.size() != field_.ranges.size())
    throw InputError(fmt::format("{} bounds for {} bricks", bounds.size(), field_.ranges.size()));
  bounds_ = DeviceArray<float>(*field_.state, bounds, "bounds of bricks");
}

void Frame::fit_picture(const RenderOptions& o) {
  const auto pixels = static_cast<std::uint64_t>(o.width * o.height),
             rows = static_cast<std::uint64_t>(o.height);
  if (picture_.size() != pixels) {
    picture_ = {};  // first give back what is held
    picture_ = DeviceArray<cl_float4>(*field_.state, pixels, "picture");
  }
  if (row_samples_.size() != rows)
    row_samples_ = DeviceArray<cl_uint>(*field_.state, rows, "samples per row");
  row_samples_.fill(0);
}

void Frame::bake_table(const RenderOptions& o) {
  const bool dvr = o.mode == RenderMode::dvr;
  const bool square = dvr && o.classification == Classification::preintegrated;
  const bool adaptive = dvr && o.step_mode == StepMode::adaptive;
  const int levels = dvr && o.step_mode == StepMode::level ? field_.highest_level + 1 : 1;
  std::vector<double> key{square ? 1.0 : adaptive ? 2.0 : 0.0, static_cast<double>(levels), o.step};
  for (const TransferPoint& p : o.transfer.points)
    key.insert(key.end(), {p.value, p.rgb[0], p.rgb[1], p.rgb[2], p.opacity});
  if (key == table_key_) return;
  table_key_.clear();  // should what follows throw
  baked_ = square     ? bake_preintegrated(o.transfer, o.step, field_.value_range)
           : adaptive ? bake_adaptive(o.transfer, o.step)
                      : bake(o.transfer, o.step, levels);
  if (table_.size() != baked_.rows.size()) {
    table_ = {};
    table_ = DeviceArray<cl_float4>(*field_.state, baked_.rows.size(), "transfer function");
  }
  table_.write(baked_.rows);
  table_key_ = std::move(key);
}

void Frame::update_distance(const RenderOptions& o, float slack, bool base_first) {
  const bool dvr = o.mode == RenderMode::dvr;
  std::vector<float> key{slack, base_first ? 1.0f : 0.0f, o.skip_empty ? 1.0f : 0.0f}, surfaces;
  for (const IsoSurface& s : o.surfaces) surfaces.push_back(static_cast<float>(s.value));
  if (dvr) {
    key.insert(key.end(), {0, baked_.lo, baked_.scale});
    key.insert(key.end(), baked_.stretch.begin(), baked_.stretch.end());
  } else {
    key.push_back(1);
    key.insert(key.end(), surfaces.begin(), surfaces.end());
  }
  if (key == distance_key_) return;
  const auto classes = dvr ? empty_bricks(field_, baked_, slack) : sides_of_surfaces(field_, surfaces, slack);
  const Index3 n{field_.bricks.bricks_x, field_.bricks.bricks_y, field_.bricks.bricks_z};
  const auto distance = base_first ? guide_of(field_, classes, o.skip_empty) : distance_to_other(classes, n);
  distance_key_.clear();
  if (distance_.size() != distance.size())
    distance_ = DeviceArray<cl_uchar>(*field_.state, distance.size(), "distances to occupied bricks");
  distance_.write(distance);
  distance_key_ = std::move(key);
}

void Frame::develop(const RenderOptions& o) {
  const std::uint64_t fours = (picture_.size() + 3) / 4;
  if (values_.size() != fours) {
    rgb_ = {};
    values_ = {};
    rgb_ = DeviceArray<cl_uchar4>(*field_.state, 3 * fours, "picture in bytes");
    values_ = DeviceArray<cl_float4>(*field_.state, fours, "values of pixels");
  }
  const char* nothing = o.mode == RenderMode::iso ? "1" : o.mode == RenderMode::mip ? "2" : "0";
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int> kernel(*field_.state, "picture/render/develop",
                                                                    "develop", {{"VDVR_NOTHING", nothing}});
  kernel({{fours, 1, 1}, {64, 1, 1}}, rgb_.buffer(), values_.buffer(), picture_.buffer(),
         static_cast<cl_int>(picture_.size()));
}

Image Frame::image(const RenderOptions& o) const {
  Image image{o.width, o.height, std::vector<std::uint8_t>(3 * picture_.size())};
  rgb_.read_mapped([&](std::span<const cl_uchar4> bytes) {
    std::memcpy(image.rgb.data(), bytes.data(), image.rgb.size());
  });
  return image;
}

FloatImage Frame::values(const RenderOptions& o) const {
  FloatImage image{o.width, o.height, std::vector<float>(picture_.size())};
  values_.read_mapped([&](std::span<const cl_float4> fours) {
    std::memcpy(image.values.data(), fours.data(), image.values.size() * sizeof(float));
  });
  return image;
}

std::int64_t Frame::samples() const {
  std::int64_t samples = 0;
  for (const cl_uint n : row_samples_.to_host()) samples += n;
  return samples;
}

}  // namespace vdvr
