#include "apps/common/messages.hpp"

#include <algorithm>
#include <set>

namespace vdvr::cli {
namespace {

const std::set<std::string>& fields_with_options() {
  static const std::set<std::string> names{"angle_unit",
                                           "beam_current",
                                           "flats_in_time",
                                           "shifts",
                                           "angles_file",
                                           "axis_roll",
                                           "azimuth",
                                           "base",
                                           "beam",
                                           "camera_focal_point",
                                           "camera_position",
                                           "camera_view_angle",
                                           "camera_view_up",
                                           "center",
                                           "certify_light",
                                           "classification",
                                           "clip",
                                           "closing",
                                           "coefficients",
                                           "covered_from",
                                           "darks",
                                           "device",
                                           "elevation",
                                           "entry",
                                           "epsilon",
                                           "epsilon_abs",
                                           "filter_cutoff",
                                           "flats",
                                           "follow_links",
                                           "gold",
                                           "gradient",
                                           "granularity",
                                           "half_acquisition",
                                           "heights",
                                           "iso",
                                           "levels",
                                           "light",
                                           "line_integrals",
                                           "max_memory",
                                           "method",
                                           "mode",
                                           "nan_as",
                                           "origin",
                                           "oversampling",
                                           "pad",
                                           "picture_finest",
                                           "range",
                                           "resume",
                                           "roi",
                                           "sampler",
                                           "samples",
                                           "scratch",
                                           "show",
                                           "size",
                                           "slice_position",
                                           "spacing",
                                           "step",
                                           "step_mode",
                                           "storage",
                                           "tf",
                                           "transmission",
                                           "u_filter",
                                           "untrusted_device",
                                           "upsampling",
                                           "views",
                                           "window",
                                           "zoom"};
  return names;
}

}  // namespace

std::string with_options(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text[at] == '`' ? text.find('`', at + 1) : std::string::npos;
    std::string name = end == std::string::npos ? "" : text.substr(at + 1, end - at - 1);
    if (fields_with_options().count(name) == 0) {
      out += text[at++];
      continue;
    }
    std::replace(name.begin(), name.end(), '_', '-');
    out += "--" + name;
    at = end + 1;
  }
  return out;
}

int exit_code_of(const Error& error) {
  switch (error.kind()) {
    case ErrorKind::mismatch:
    case ErrorKind::tolerance:
      return 1;
    case ErrorKind::input:
    case ErrorKind::file:
      return 2;
    case ErrorKind::interrupted:
      return static_cast<const Interrupted&>(error).reason();
    default:
      return 3;
  }
}

}  // namespace vdvr::cli
