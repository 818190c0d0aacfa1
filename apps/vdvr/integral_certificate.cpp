#include "apps/vdvr/integral_certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/vdvr/certify_render.hpp"
#include "apps/vdvr/picture_certificate.hpp"
#include "vdvr/error.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/output_file.hpp"
#include "vdvr/stop.hpp"

namespace vdvr::cli {

void check_integral_certificate(const Arguments& args, bool values) {
  const std::string show = args.text_or("show", "colour");
  if (show == "class" || show == "band") throw InputError(fmt::format("--show {}: is of --mode iso", show));
  if (!asks_certify(args)) return;
  refuse(args, {"turntable", "method", "unverified", "axes", "box", "colorbar", "caption"},
         "does not go with --certify, which is of one plain picture of the certified field");
  if (show != "colour" && show != "bound" && show != "lo" && show != "hi")
    throw InputError(
        fmt::format("--show {}: has no certificate of --mode integral; bound, lo and hi have", show));
  if (values && show == "colour") throw InputError("--certify writes values of --show bound, lo or hi");
  if (!values && (show == "lo" || show == "hi"))
    throw InputError(fmt::format("--show {}: is written as .npy", show));
}

RayCertificate write_integral_certificate(const Arguments& args, Source& source, const RenderOptions& options,
                                          const RenderResult& drawn, const std::filesystem::path& output,
                                          const Progress& progress) {
  const Scene& scene = source.scene();
  CertifiedPicture picture = described(source, options, drawn, output);
  const CertifiedRays rays(scene.volume, *scene.certificate, false, box_of(options.clip));
  const IntegralBounds integrals = rays.integral(options.camera, options.width, options.height, progress);
  throw_if_stopped();
  const PixelBounds bounds = greys_of_integrals(integrals, options);
  const PictureBound bound = bound_of_picture(bounds, drawn.image);
  const Image bounds_image = picture_of_bound(bound, bounds);
  const std::string show = args.text_or("show", "colour");
  const auto beside = ray_certificate_paths(output, options.mode);
  io::AtomicFiles files;
  const auto picture_part = files.add(output), certificate_part = files.add(beside.front()),
             bound_part = files.add(beside.back());
  if (output.extension() == ".npy")
    write_npy(picture_part, show == "lo" ? integrals.low : show == "hi" ? integrals.high : bound.levels);
  else write_png(picture_part, show == "bound" ? bounds_image : drawn.image);
  write_png(bound_part, bounds_image);
  picture.file_sha256 = sha256_of_file(picture_part);
  Json json = picture_certificate_json(picture, bounds, bound, *scene.certificate);
  json["integral"] = half_widths_json(integrals.low, integrals.high, integrals.met);
  io::write_file(certificate_part, json.dump(2) + "\n");
  files.commit();
  return {std::move(json), pixels_beyond(args, bound)};
}

void print_integral_certificate(const RayCertificate& certificate) {
  print_known(certificate.json, "greys", "integral", "integral");
  print_tolerance(certificate.beyond);
}

}  // namespace vdvr::cli
