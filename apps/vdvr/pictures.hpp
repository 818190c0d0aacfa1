// What `render`, `run` and `bench render` share: opening something to look at.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/vdvr/options.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {

/// A certified volume with its certificate, or a uniform one without.
struct Scene {
  MixedVolume volume;
  std::optional<Certificate> certificate;
  bool verified = false;  ///< the content's hash was compared with the certificate's
};
/// `method`: "vdvr" the mixed volume, "dvr" its base samples alone (a uniform volume is the same either way).
/// Throws MismatchError for a content that does not match, unless `unverified`.
Scene open_scene(const std::filesystem::path& path, const Arguments& args, const std::string& method,
                 bool unverified);

const char* sampler_name(SamplerKind kind);

}  // namespace vdvr::cli
