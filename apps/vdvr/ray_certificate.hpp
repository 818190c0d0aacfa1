// `render --certify` of surfaces and maxima: what is certain of F in a picture, beside the picture or in its
// place.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/vdvr/picture_tolerance.hpp"
#include "apps/vdvr/source.hpp"
#include "vdvr/image.hpp"
#include "vdvr/progress.hpp"

namespace vdvr::cli {

struct CertifiedPicture;
/// All that the picture follows from; its file's hash comes when it is written.
CertifiedPicture described(Source& source, const RenderOptions& options, const RenderResult& drawn,
                           const std::filesystem::path& output);
/// What --show has beside its usual values; the option is declared by add_certify (certify_render.hpp).
inline const std::vector<std::string>& certified_outputs() {
  static const std::vector<std::string> names{"class", "band", "lo", "hi", "bound"};
  return names;
}
/// Refuses what goes with no certificate; before anything is read.
void check_ray_certificate(const Arguments& args, RenderMode mode, bool values);
/// What is written beside the picture: the certificate, of mode mip also the picture of the bound.
std::vector<std::filesystem::path> ray_certificate_paths(const std::filesystem::path& output,
                                                         RenderMode mode);

struct RayCertificate {
  Json json;  ///< of the file
  std::optional<PixelsBeyond> beyond;
};
/// The certificate of a picture of the source. `drawn` with `options`: is marked and written, or what --show
/// asks for. All of it appears together.
RayCertificate write_ray_certificate(const Arguments& args, Source& source, const RenderOptions& options,
                                     const RenderResult& drawn, const std::filesystem::path& output,
                                     const Progress& progress);
/// Levels of what is shown, and how well the value of F behind it is known: `member` of the JSON.
void print_known(const Json& json, const std::string& shown, const char* member, const char* what);
void print_ray_certificate(const RayCertificate& certificate);

}  // namespace vdvr::cli
