// One text for JSON beside a file, one for TIFF's ImageDescription.
#include "host/export/export_note.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "vdvr/error.hpp"

namespace vdvr {

ExportNote note_of(const Grid& grid) {
  if (grid.unit.find_first_of("\n\r\"") != std::string::npos)
    throw InputError("the volume's unit holds quotes or line ends, which no other format takes");
  ExportNote note;
  note.grid = grid;
  return note;
}

ExportNote note_of(const VdvrFile& file, const Grid& grid) {
  ExportNote note = note_of(grid);
  const Certificate& c = file.certificate;
  note.certified = !c.comparison;
  note.epsilon = c.epsilon;
  note.epsilon_abs = c.epsilon_abs;
  note.content_sha256 = c.content_sha256;
  return note;
}

const char* numpy_name(SampleType type) {
  return type == SampleType::f32 ? "float32" : type == SampleType::u16 ? "uint16" : "uint8";
}

std::size_t bytes_of(SampleType type) {
  return type == SampleType::f32 ? 4 : type == SampleType::u16 ? 2 : 1;
}

nlohmann::ordered_json certificate_note(const ExportNote& n) {
  nlohmann::ordered_json j = {{"certified", n.certified}};
  if (n.certified) {
    j["epsilon"] = n.epsilon;
    j["epsilon_abs"] = n.epsilon_abs;
  }
  if (!n.content_sha256.empty()) {
    j["exact_between_samples"] = n.exact_between_samples;
    if (n.certified && n.exact_between_samples && n.samples == SampleType::f32)
      j["between_samples_abs"] = n.epsilon_abs + n.jump;
    j["content_sha256"] = n.content_sha256;
  }
  j["generator"] = "vdvr " VDVR_VERSION;
  return j;
}

nlohmann::ordered_json note_json(const ExportNote& n, const std::string& name) {
  const Index3 s = n.grid.samples();
  const auto zyx = [](const auto& v) { return nlohmann::ordered_json{v[2], v[1], v[0]}; };
  nlohmann::ordered_json j = {{"file", name},
                              {"type", numpy_name(n.samples)},
                              {"byte_order", "little"},
                              {"axes", {"z", "y", "x"}},
                              {"shape", zyx(s)},
                              {"spacing", zyx(n.grid.spacing)},
                              {"origin", zyx(n.grid.origin)},
                              {"unit", n.grid.unit},
                              {"value", "offset + scale * stored"},
                              {"scale", n.scale},
                              {"offset", n.offset}};
  j.update(certificate_note(n));
  return j;
}

std::string imagej_text(const ExportNote& n, std::int64_t images) {
  const Grid& g = n.grid;
  std::string text = fmt::format("ImageJ=1.54f\nimages={0}\nslices={0}\nunit={1}\nspacing={2}\nloop=false\n",
                                 images, g.unit, g.spacing[2]);
  // ImageJ's origin is the pixel that lies at zero.
  text += fmt::format("xorigin={}\nyorigin={}\nzorigin={}\n", -g.origin[0] / g.spacing[0],
                      -g.origin[1] / g.spacing[1], -g.origin[2] / g.spacing[2]);
  const double top = std::ldexp(1.0, static_cast<int>(8 * bytes_of(n.samples))) - 1;
  if (n.samples == SampleType::f32 && n.range_is_known)
    text += fmt::format("min={}\nmax={}\n", n.lowest, n.highest);
  if (n.samples != SampleType::f32)
    text += fmt::format("min=0\nmax={}\ncf=0\nc0={}\nc1={}\nvunit=density\n", top, n.offset, n.scale);
  if (n.certified) text += fmt::format("vdvr_epsilon_abs={}\n", n.epsilon_abs);
  if (!n.content_sha256.empty()) text += fmt::format("vdvr_content_sha256={}\n", n.content_sha256);
  return text;
}

}  // namespace vdvr
