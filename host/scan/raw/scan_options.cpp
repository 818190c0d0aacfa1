#include "vdvr/expert/scan_options.hpp"

namespace vdvr {

const char* text_of(Beam beam) { return beam == Beam::cone ? "cone" : "parallel"; }

std::optional<Beam> beam_of(const std::string& text) {
  for (const Beam beam : {Beam::parallel, Beam::cone})
    if (text == text_of(beam)) return beam;
  return {};
}

}  // namespace vdvr
