// X.certificate.json of pictures of every mode, as verify_picture() reads it.
#include "host/picture/pixel/picture_json.hpp"
#include "tests/fuzz/target.hpp"

namespace vdvr::fuzz {
namespace {

std::string certificate_of(RenderMode mode) {
  CertifiedPicture picture;
  PictureRecord& record = picture.record;
  record.options.mode = mode;
  record.options.surfaces = {{0.5, 1}};
  record.options.slice_position = 0.25;
  record.options.slice_range = std::pair{0.0, 1.5};
  record.options.transfer = {"f", {{0, {0, 0, 0}, 0}, {1, {1, 0.5, 0}, 0.25}}};
  record.options.lights = {{1, 0, 0}};
  record.options.clip = Clip{{-1, -2, -3}, {1, 2, 3}, {0, 0}, 4};
  record.content_sha256 = record.pixels_sha256 = std::string(64, 'a');
  record.sampler = ChargedSampler{"buffer", 0.001, "rounding"};
  picture.epsilon = 0.03;
  picture.unit = "pixel";
  const FloatImage depth{2, 1, {1, 2}, 1};
  picture.surface = {{1, 2}, depth, depth};
  picture.maxima = {depth, depth, depth, depth};
  picture.integrals = {depth, depth, {1, 1}};
  picture.bounds.lo = picture.bounds.hi = FloatImage{2, 1, std::vector<float>(6, 0.5f), 3};
  picture.bounds.parts = {1, 0};
  picture.bounds.untested = {0, 1};
  picture.bound = bound_of_picture(picture.bounds, {2, 1, std::vector<std::uint8_t>(6, 128)});
  return picture_certificate_json(picture, "x.png", std::string(64, 'b'), {{}, {"box"}, {}});
}

std::vector<std::string> seeds(const std::filesystem::path&) {
  std::vector<std::string> texts;
  for (const RenderMode mode :
       {RenderMode::dvr, RenderMode::iso, RenderMode::mip, RenderMode::slice, RenderMode::integral})
    texts.push_back(certificate_of(mode));
  return texts;
}

void read(const std::filesystem::path& file) { static_cast<void>(read_picture_certificate(file)); }

}  // namespace

const Target fuzz_target{"x.certificate.json", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
