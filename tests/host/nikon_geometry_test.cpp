// A Nikon scanner's folder.
#define BOOST_TEST_MODULE nikon_geometry
#include <boost/test/unit_test.hpp>
#include <optional>
#include <sstream>

#include "host/scan/open/nikon_geometry.hpp"
#include "tests/support/cone_files.hpp"
#include "vdvr/expert/hash.hpp"

using namespace vdvr;
using namespace vdvr::support;

extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

// --- Nikon ---

namespace {

// The scan of write_folder() as a Nikon scanner writes it, but for the level of its darks: 0.
std::string xtekct(const std::string& more = "") {
  return "[XTekCT]\r\nName=view\r\nInputFolderName=p\r\nSrcToObject=50\r\nSrcToDetector=100\r\n"
         "DetectorPixelsX=3\r\nDetectorPixelsY=2\r\nDetectorPixelSizeX=0.5\r\nDetectorPixelSizeY=0.25\r\n"
         "Projections=4\r\nInitialAngle=10\r\nAngularStep=90\r\nWhiteLevel=60000\r\n" +
         more + "[Xrays]\r\nXraykV=120\r\n";
}

}  // namespace

BOOST_AUTO_TEST_CASE(nikon_scan_is_read_with_its_white_level_and_clockwise_angles) {
  const TemporaryFolder folder;
  write_folder(folder);
  static_cast<void>(folder.file("s.xtekct", xtekct()));
  static_cast<void>(folder.file("scan.json", R"({"nikon": "s.xtekct"})"));
  const ProjectionSet scan = read_scan(folder.path());
  BOOST_TEST(scan.cone->views.size() == 4u);
  BOOST_TEST(scan.geometry.unit == "mm");
  BOOST_TEST(std::abs(scan.geometry.center - 1) <= same_geometry);
  BOOST_TEST(std::abs(scan.geometry.pitch_u - 0.25) <= same_geometry);
  BOOST_TEST(scan.report.source_to_detector == 100);
  const double expected = -std::log(static_cast<double>(static_cast<float>(raw_count(2, 1, 1))) / 60000);
  BOOST_TEST(std::abs(static_cast<double>(scan.data[2 * V * U + U + 1]) - expected) <=
             tolerance::fp32_sum(2, expected));
  const double theta = -100 * radians;
  BOOST_TEST(std::abs(cone_view(scan.cone->views[1]).source[0] - 50 * std::sin(theta)) <= same_geometry * 50);
  BOOST_TEST(noted(scan, "clockwise"));
  BOOST_TEST(noted(scan, "sign is assumed"));
  // The files' places in the hash: the .xtekct file and the frames.
  std::vector<std::string> lines;
  for (const char* name :
       {"s.xtekct", "scan.json", "p/view_8.tif", "p/view_9.tif", "p/view_10.tif", "p/view_11.tif"})
    lines.push_back(sha256_of_file(folder / name) + " " + name + "\n");
  std::sort(lines.begin(), lines.end());
  std::string text;
  for (const auto& line : lines) text += line;
  BOOST_TEST(scan.report.sha256 == sha256_of_text(text));
}

BOOST_AUTO_TEST_CASE(nikon_axis_lies_where_the_file_puts_it) {
  const TemporaryFolder folder;
  write_folder(folder);
  static_cast<void>(folder.file("scan.json", R"({"nikon": "s.xtekct"})"));
  const auto with = [&](const std::string& more) {
    static_cast<void>(folder.file("s.xtekct", xtekct(more)));
    return read_scan(folder.path());
  };
  // 0.125 mm at the object is 0.25 mm, half a column, on the detector.
  BOOST_TEST(std::abs(with("ObjectOffsetX=0.125\r\n").geometry.center - 1.5) <= same_geometry);
  BOOST_TEST(std::abs(with("CentreOfRotationTop=0.25\r\nCentreOfRotationBottom=0.25\r\n").geometry.center -
                      1.5) <= same_geometry);
  // A tilted axis: points of it are seen where top and bottom say, half a row beyond the outer rows' centres.
  const ProjectionSet tilted = with("CentreOfRotationTop=0.25\r\nCentreOfRotationBottom=-0.25\r\n");
  const ViewMatrix& m = tilted.cone->views[0];
  for (const double z : {-0.1, 0.1}) {
    const double u = (m[0][2] * z + m[0][3]) / (m[2][2] * z + m[2][3]),
                 v = (m[1][2] * z + m[1][3]) / (m[2][2] * z + m[2][3]);
    // From 0.25 mm at row -1/2 to -0.25 mm at row 3/2: a column of 0.5 mm over two rows.
    BOOST_TEST(std::abs(u - (1.5 - (v + 0.5) / 2)) <= same_geometry * 10);
  }
}

BOOST_AUTO_TEST_CASE(nikon_files_that_lack_or_contradict_something_are_refused) {
  const TemporaryFolder folder;
  write_folder(folder);
  static_cast<void>(folder.file("scan.json", R"({"nikon": "s.xtekct"})"));
  for (const auto& [part, broken, says] : std::vector<std::array<std::string, 3>>{
           {"SrcToObject=50", "SrcToObject=-50", "SrcToObject is -50"},
           {"SrcToObject=50\r\n", "", "SrcToObject is missing"},
           {"AngularStep=90", "AngularStep=9O", "AngularStep is '9O'"},
           {"Projections=4", "Projections=5", "4 TIFF files begin with 'view'"},
           {"DetectorPixelsX=3", "DetectorPixelsX=4", "4 columns x 2 rows"},
           {"Projections=4", "Projections=4\r\nProjections=3", "given twice"},
           {"Name=view", "Name=other", "'projections'"}}) {
    std::string text = xtekct();
    text.replace(text.find(part), part.size(), broken);
    static_cast<void>(folder.file("s.xtekct", text));
    BOOST_TEST(has(refusal(folder.path()), says));
  }
  const std::string whole = xtekct();
  for (std::size_t n = 0; n < whole.size(); ++n) {
    try {
      static_cast<void>(io::read_nikon(folder.file("cut", whole.substr(0, n))));
    } catch (const FileError&) {
    }
  }
}
