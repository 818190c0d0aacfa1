// --picture-tolerance N of render: which pixels are not certain to N levels of 255.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/vdvr/output.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr::cli {

struct PixelsBeyond {
  double tolerance = 0;
  std::int64_t count = 0;
  std::string first;  ///< some of them, with their bounds
};
/// Nothing where no tolerance was asked for.
std::optional<PixelsBeyond> pixels_beyond(const Arguments& args, const PictureBound& bound);
Json tolerance_json(const PixelsBeyond& beyond);
/// Prints that all are certain, where they are.
void print_tolerance(const std::optional<PixelsBeyond>& beyond);
/// Throws MismatchError, which names the pixels, where there are some.
void require_within(const std::filesystem::path& output, const std::optional<PixelsBeyond>& beyond);

}  // namespace vdvr::cli
