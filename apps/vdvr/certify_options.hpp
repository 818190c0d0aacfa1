// The options of certified pictures: their declaration, and which of them go together.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common/arguments.hpp"
#include "vdvr/certified_picture.hpp"

namespace vdvr::cli {

void add_certify(Arguments& args);
/// Whether the options ask for it.
bool asks_certify(const Arguments& args);
/// Modes of which each ray is certified on the host.
inline bool is_certified_by_ray(RenderMode mode) {
  return mode == RenderMode::iso || mode == RenderMode::mip || mode == RenderMode::integral;
}
/// What --show has of a certified picture beside its usual values.
const std::vector<std::string>& certified_outputs();
/// Throws InputError, before anything is read, for options that do not go together.
void check_certify(const Arguments& args, const RenderOptions& options);
/// What the options ask for; `covered`: as --covered-from tells it.
PictureRequest picture_request(const Arguments& args, const RenderOptions& options,
                               const std::optional<CoveredCylinder>& covered);

}  // namespace vdvr::cli
