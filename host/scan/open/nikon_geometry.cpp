// Nikon's .xtekct: an INI file of section XTekCT. It does not say which way the object turns nor which way
// its offsets point, and programs that read it differ. What is assumed here is what CIL assumes, and is
// noted.
#include "host/scan/open/nikon_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "host/base/system/casts.hpp"
#include "host/files/io/number_text.hpp"
#include "host/files/io/text_encoding.hpp"
#include "host/files/io/volume_stack.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;

// The members of section XTekCT, and of lines before any section.
class Members {
 public:
  explicit Members(fs::path path) : path_(std::move(path)) {
    std::error_code error;
    if (!fs::is_regular_file(path_, error)) fail("no such file, or not readable");
    constexpr std::uintmax_t largest = 16u << 20;
    std::istringstream file(read_text(path_, "a description", largest));
    bool ours = true;
    for (std::string line; std::getline(file, line);) {
      const std::string_view text = without_blanks(line);
      if (!text.empty() && text.front() == '[') ours = text == "[XTekCT]";
      const auto equals = text.find('=');
      if (!ours || equals == std::string_view::npos) continue;
      const std::string key(without_blanks(text.substr(0, equals))),
          value(without_blanks(text.substr(equals + 1)));
      if (const auto [it, added] = values_.emplace(key, value); !added && it->second != value)
        fail(fmt::format("{} is given twice, as '{}' and '{}'", key, it->second, value));
    }
  }

  [[noreturn]] void fail(const std::string& what) const { throw FileError(path_.string() + ": " + what); }
  std::string text(const std::string& key) const {
    const auto it = values_.find(key);
    return it == values_.end() ? "" : it->second;
  }
  std::optional<double> find(const std::string& key) const {
    const std::string value = text(key);
    if (value.empty()) return {};
    const auto number = number_of(value);
    if (!number) fail(fmt::format("{} is '{}', not a number{}", key, value.substr(0, 40), comma_hint(value)));
    return number;
  }
  double need(const std::string& key) const {
    if (const auto value = find(key)) return *value;
    fail(fmt::format("{} is missing in section XTekCT: truncated, or no .xtekct file", key));
  }
  double positive(const std::string& key) const {
    const double value = need(key);
    if (!(value > 0)) fail(fmt::format("{} is {}; it must be positive", key, value));
    return value;
  }
  std::int64_t count(const std::string& key) const {
    const double value = positive(key);
    if (value != std::floor(value) || value > 0x1p31)
      fail(fmt::format("{} is {}; it must be a whole number", key, value));
    return static_cast<std::int64_t>(value);
  }

 private:
  fs::path path_;
  std::map<std::string, std::string> values_;
};

// Names within `folder`, relative to the scan's folder.
std::vector<std::string> tiffs_in(const fs::path& folder, const NikonScan& nikon, const Description& scan) {
  std::error_code error;
  if (!fs::is_directory(scan.folder() / folder, error)) return {};
  std::vector<std::string> all = scan.matches((folder / "*").generic_string(), "nikon");
  std::erase_if(all, [&](const std::string& name) {
    return !is_tiff_path(name) || fs::path(name).filename().string().rfind(nikon.name, 0) != 0;
  });
  return all;
}

void note_assumptions(const NikonScan& n, double center, ConeViews& out) {
  out.notes.push_back(fmt::format(
      "angles are -(InitialAngle + i AngularStep), {:g} to {:g} degrees, seen from row 0: clockwise, which "
      "the "
      "file does not say; `.ang` and `_ctdata.txt` files are not read",
      -n.initial_angle, -(n.initial_angle + static_cast<double>(n.projections - 1) * n.angular_step)));
  out.notes.push_back(fmt::format(
      "the axis is at column {:.3f} by {}, whose sign is assumed; give `center` where it is elsewhere",
      center, n.object_offset ? "ObjectOffsetX" : "CentreOfRotationTop and -Bottom"));
  if (n.detector_offset_x != 0 || n.detector_offset_y != 0)
    out.notes.push_back(
        fmt::format("DetectorOffsetX {:g} and DetectorOffsetY {:g} are not applied: the "
                    "source's axis is assumed to hit the detector's middle",
                    n.detector_offset_x, n.detector_offset_y));
}

}  // namespace

NikonScan read_nikon(const fs::path& path) {
  const Members members(path);
  NikonScan n;
  n.path = path;
  n.name = members.text("Name");
  n.input_folder = members.text("InputFolderName");
  std::replace(n.input_folder.begin(), n.input_folder.end(), '\\', '/');
  n.projections = members.count("Projections");
  n.columns = members.count("DetectorPixelsX");
  n.rows = members.count("DetectorPixelsY");
  n.pixel_x = members.positive("DetectorPixelSizeX");
  n.pixel_y = members.positive("DetectorPixelSizeY");
  n.source_to_object = members.positive("SrcToObject");
  n.source_to_detector = members.positive("SrcToDetector");
  n.white_level = members.positive("WhiteLevel");
  n.initial_angle = members.need("InitialAngle");
  n.angular_step = members.need("AngularStep");
  n.center_top = members.find("CentreOfRotationTop").value_or(0);
  n.center_bottom = members.find("CentreOfRotationBottom").value_or(0);
  n.object_offset = members.find("ObjectOffsetX");
  n.object_roll = members.find("ObjectRoll");
  n.object_tilt = members.find("ObjectTilt").value_or(0);
  n.detector_offset_x = members.find("DetectorOffsetX").value_or(0);
  n.detector_offset_y = members.find("DetectorOffsetY").value_or(0);
  return n;
}

std::vector<std::string> nikon_projections(const NikonScan& nikon, const Description& scan) {
  const fs::path beside = nikon.path.lexically_relative(scan.folder()).parent_path();
  std::vector<std::string> names;
  if (const fs::path folder(nikon.input_folder); !folder.empty() && folder.is_relative())
    names = tiffs_in((beside / folder).lexically_normal(), nikon, scan);
  if (names.empty()) names = tiffs_in(beside, nikon, scan);
  if (static_cast<std::int64_t>(names.size()) != nikon.projections)
    scan.fail(
        fmt::format("'nikon': {} TIFF files begin with '{}' in InputFolderName '{}' or beside the "
                    ".xtekct file, its Projections is {}; name the files with 'projections'",
                    names.size(), nikon.name, nikon.input_folder, nikon.projections));
  return names;
}

// CIL's frame, seen from the source with the axis upright, has columns to the left and rows down; ours is
// that turned by half a turn, so that columns run to the right and rows along the axis. Offsets of the object
// along the columns, and the axis' tilt in the detector's plane, keep their signs; tilts towards the detector
// change theirs.
ConeViews nikon_geometry(const NikonScan& n, const StackShape& stack) {
  require_views(n.path.string(), "Projections", n.projections, stack);
  require_detector(n.path.string(), n.columns, n.rows, stack);
  CircularView view;
  view.source_to_axis = n.source_to_object;
  view.source_to_detector = n.source_to_detector;
  view.pitch_u = n.pixel_x;
  view.pitch_v = n.pixel_y;
  view.row = stack.middle_row();
  const double on_detector = n.object_offset ? *n.object_offset * n.source_to_detector / n.source_to_object
                                             : 0.5 * (n.center_top + n.center_bottom);
  view.in_plane_rad =
      n.object_roll ? *n.object_roll / degrees_per_radian
                    : std::atan2(n.center_bottom - n.center_top, static_cast<double>(n.rows) * n.pixel_y);
  view.out_of_plane_rad = -n.object_tilt / degrees_per_radian;
  // The axis moves, not the detector: the source's axis still hits the detector's middle.
  view.center = stack.middle_column();
  view.source_offset_u = -on_detector * n.source_to_object / n.source_to_detector;
  view.detector_offset_u = view.source_offset_u;
  ConeViews out;
  for (std::int64_t i = 0; i < n.projections; ++i) {
    view.theta_rad = -(n.initial_angle + static_cast<double>(i) * n.angular_step) / degrees_per_radian;
    out.views.push_back(checked_view(view, n.path.string(), i));
  }
  out.center_source = "file";
  out.unit = "mm";
  out.source_to_detector = n.source_to_detector;
  note_assumptions(n, cone_view(out.views.front()).center, out);
  return out;
}

}  // namespace vdvr::io
