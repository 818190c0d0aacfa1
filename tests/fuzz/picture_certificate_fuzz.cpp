// X.certificate.json of pictures of every mode, as `verify --picture` reads it.
#include "apps/vdvr/picture_certificate.hpp"
#include "tests/fuzz/target.hpp"

namespace vdvr::fuzz {
namespace {

std::string certificate_of(RenderMode mode) {
  cli::CertifiedPicture picture;
  picture.options.mode = mode;
  picture.options.surfaces = {{0.5, 1}};
  picture.options.slice_position = 0.25;
  picture.options.slice_range = std::pair{0.0, 1.5};
  picture.options.transfer = {"f", {{0, {0, 0, 0}, 0}, {1, {1, 0.5, 0}, 0.25}}};
  picture.options.lights = {{1, 0, 0}};
  picture.options.clip = Clip{{-1, -2, -3}, {1, 2, 3}, {0, 0}, 4};
  picture.content_sha256 = picture.pixels_sha256 = picture.file_sha256 = std::string(64, 'a');
  picture.file = "x.png";
  picture.overlays = {"box"};
  Certificate certificate;
  certificate.epsilon = 0.03;
  if (mode == RenderMode::iso) {
    cli::Json json = cli::certificate_head(picture, certificate, cli::statement_of(mode));
    const FloatImage depth{2, 1, {1, 2}, 1};
    json["iso"] = cli::surface_json({{1, 2}, depth, depth}, "pixel");
    return json.dump();
  }
  PixelBounds bounds;
  bounds.lo = bounds.hi = FloatImage{2, 1, std::vector<float>(6, 0.5f), 3};
  bounds.parts = {1, 0};
  bounds.untested = {0, 1};
  const PictureBound bound = bound_of_picture(bounds, {2, 1, std::vector<std::uint8_t>(6, 128)});
  return cli::picture_certificate_json(picture, bounds, bound, certificate).dump();
}

std::vector<std::string> seeds(const std::filesystem::path&) {
  std::vector<std::string> texts;
  for (const RenderMode mode :
       {RenderMode::dvr, RenderMode::iso, RenderMode::mip, RenderMode::slice, RenderMode::integral})
    texts.push_back(certificate_of(mode));
  return texts;
}

void read(const std::filesystem::path& file) { static_cast<void>(cli::read_picture_certificate(file)); }

}  // namespace

const Target fuzz_target{"x.certificate.json", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
