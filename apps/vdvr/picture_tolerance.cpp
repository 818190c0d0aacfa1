#include "apps/vdvr/picture_tolerance.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "vdvr/error.hpp"

namespace vdvr::cli {

std::optional<PixelsBeyond> pixels_beyond(const Arguments& args, const PictureBound& bound) {
  const std::optional<double> tolerance = args.number("picture-tolerance");
  if (!tolerance) return std::nullopt;
  constexpr std::int64_t named = 8;
  PixelsBeyond beyond{*tolerance, 0, {}};
  for (std::size_t i = 0; i < bound.levels.values.size(); ++i) {
    if (static_cast<double>(bound.levels.values[i]) <= *tolerance) continue;
    const auto at = static_cast<std::int64_t>(i);
    if (++beyond.count <= named)
      beyond.first += fmt::format("{}({}, {}) {:.1f}", beyond.count == 1 ? "" : ", ", at % bound.levels.width,
                                  at / bound.levels.width, bound.levels.values[i]);
  }
  if (beyond.count > named) beyond.first += fmt::format(" and {} more", beyond.count - named);
  return beyond;
}

Json tolerance_json(const PixelsBeyond& beyond) {
  return {{"levels", beyond.tolerance}, {"pixels_beyond", beyond.count}};
}

void print_tolerance(const std::optional<PixelsBeyond>& beyond) {
  if (beyond && beyond->count == 0)
    fmt::print("  every pixel is certain to {:g} levels\n", beyond->tolerance);
}

void require_within(const std::filesystem::path& output, const std::optional<PixelsBeyond>& beyond) {
  if (!beyond || beyond->count == 0) return;
  throw MismatchError(fmt::format("{}: {} pixels are not certain to {:g} levels: {}", output.string(),
                                  beyond->count, beyond->tolerance, beyond->first));
}

}  // namespace vdvr::cli
