// render --certify: a picture, the bound of its pixels and its certificate.
#pragma once

#include <filesystem>
#include <optional>
#include <nlohmann/json.hpp>

#include "apps/vdvr/overlay.hpp"
#include "apps/vdvr/picture_tolerance.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr::cli {

/// What is written, and shown of it.
struct CertifiedRender {
  CertifiedPicture picture;
  Json json;  ///< the certificate, as it lies beside the picture
  std::optional<PixelsBeyond> beyond;
};

/// Draws, certifies and writes what --show asks for. Throws InputError for what is not certified; else as
/// certify_picture().
CertifiedRender certify_render(const Arguments& args, const CommonOptions& common, Source& source,
                               const RenderOptions& options, const Overlay& overlay,
                               const std::filesystem::path& output, const Progress& progress);
/// Modes dvr and slice: all of what the command prints. Throws MismatchError where --picture-tolerance is not
/// met.
void say_certified(const Arguments& args, const CommonOptions& common, Source& source,
                   const CertifiedRender& made, const std::filesystem::path& output);
/// Other modes: what is certain.
void print_certain(const CertifiedRender& made);

}  // namespace vdvr::cli
