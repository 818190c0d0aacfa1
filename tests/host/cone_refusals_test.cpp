// What files of cone-beam geometry are refused for, one by one.
#define BOOST_TEST_MODULE cone_refusals
#include <boost/test/unit_test.hpp>
#include <optional>
#include <sstream>

#include "host/files/io/npy_file.hpp"
#include "host/scan/open/rtk_geometry.hpp"
#include "tests/support/cone_files.hpp"

using namespace vdvr;
using namespace vdvr::support;

extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

// --- refusals ---

BOOST_AUTO_TEST_CASE(contradictions_and_bad_values_are_refused_by_member) {
  const Scan scan;
  const json good = scan.geometry();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> matrices = matrices_of(scan.read(good));
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(matrices, "12, 3, 4")));
  for (const auto& [change, says] : std::vector<std::pair<json, std::string>>{
           {{{"matrices", "P.npy"}}, "'geometry' and 'matrices'"},
           {{{"pitch", 1}}, "'pitch'"},
           {{{"center", 3}}, "'geometry.center'"},
           {{{"angles", {0, 1, 2}}}, "'angles' gives 3 angles, 'geometry.angles' 12"},
           {{{"angle_range", {0, 3}}}, "'angle_range' needs 'angles'"}}) {
    json members = good;
    members.update(change);
    BOOST_TEST(has(scan.refused(members), says));
  }
  for (const auto& [change, says] : std::vector<std::pair<json, std::string>>{
           {{{"source_to_axis", 0}}, "'geometry.source_to_axis' is 0"},
           {{{"source_to_axis", nullptr}}, "'geometry.source_to_axis' is missing"},
           {{{"source_to_detector", -150}}, "'geometry.source_to_detector' is -150"},
           {{{"pitch", {0.4, 0}}}, "pitch of rows is 0"},
           {{{"pitch", "wide"}}, "'geometry.pitch'"},
           {{{"angles", {0, 90}}}, "2 angles for 12 projections"},
           {{{"angles", nullptr}}, "'geometry.angles' is missing"},
           {{{"sense", 2}}, "'geometry.sense' is 2"},
           {{{"tilt", 3}}, "'geometry.tilt'"},
           {{{"center", 20}}, "centre 20"},
           {{{"helix", 1}}, "'geometry.helix' is unknown"}})
    BOOST_TEST(has(scan.refused(scan.geometry(change)), says));
  BOOST_TEST(has(scan.refused({{"geometry", 3}}), "'geometry' must be an object"));
  BOOST_TEST(
      has(scan.refused({{"matrices", "P.npy"}, {"angles", {0, 1}}}), "'angles' contradicts 'matrices'"));
  BOOST_TEST(has(scan.refused({{"matrices", "../P.npy"}}), "stay within"));
  BOOST_TEST(
      has(scan.refused({{"angles", scan.setup.angles()}, {"redundancy", "displaced"}}), "'redundancy'"));

  const auto with = [&](const std::vector<double>& values, const std::string& shape) {
    static_cast<void>(scan.folder.file("P.npy", npy_bytes(values, shape)));
    return scan.refused({{"matrices", "P.npy"}});
  };
  std::vector<double> broken = matrices;
  broken[30] = nan;
  BOOST_TEST(has(with(broken, "12, 3, 4"), "view 2: the matrix holds a number that is not finite"));
  broken = matrices;
  broken[12 + 11] = 0;
  BOOST_TEST(has(with(broken, "12, 3, 4"), "view 1: the isocentre lies in the plane"));
  broken = matrices;
  for (std::size_t j = 0; j < 4; ++j) broken[4 + j] = broken[j];
  BOOST_TEST(has(with(broken, "12, 3, 4"), "view 0: a view's matrix is singular"));
  broken = matrices;
  for (std::size_t j = 0; j < 4; ++j) broken[4 + j] += 0.1 * broken[j];
  BOOST_TEST(has(with(broken, "12, 3, 4"), "degrees"));
  BOOST_TEST(has(with(matrices, "12, 4, 3"), "12 x 4 x 3"));
  matrices.resize(11 * 12);
  BOOST_TEST(has(with(matrices, "11, 3, 4"), "11 matrices for 12 projections"));
}

BOOST_AUTO_TEST_CASE(stacks_that_are_turned_or_of_another_kind_are_refused_for_rtk) {
  const Scan scan;
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const auto with = [&](const std::string& place) {
    static_cast<void>(scan.folder.file("stack.mha", stack_bytes(columns, rows, views, place)));
    return scan.refused({{"rtk_geometry", "g.xml"}});
  };
  BOOST_TEST(has(with("TransformMatrix = 1 0 0 0 -1 0 0 0 1\n"), "TransformMatrix"));
  BOOST_TEST(has(with("ElementSpacing = 0.4 -0.5 1\n"), "spacing -0.5"));
  BOOST_TEST(with(scan.setup.place()) == "accepted");
  static_cast<void>(scan.folder.file("stack.mha", stack_bytes(columns, rows, views - 1, scan.setup.place())));
  BOOST_TEST(has(scan.refused({{"rtk_geometry", "g.xml"}}), "12 projections described for 11 projections"));
}

BOOST_AUTO_TEST_CASE(astra_files_of_another_detector_or_type_are_refused) {
  const Scan scan;
  const auto with = [&](const json& change) {
    json astra = astra_vectors(scan.setup);
    astra.update(change);
    static_cast<void>(scan.folder.file("a.json", astra.dump()));
    return scan.refused({{"astra", "a.json"}});
  };
  BOOST_TEST(has(with({{"type", "parallel3d"}}), "'type' is 'parallel3d'"));
  BOOST_TEST(has(with({{"DetectorColCount", 9}}), "9 columns x 6 rows"));
  BOOST_TEST(has(with({{"Vectors", {{1, 2, 3}}}}), "entry 0 must hold 12 numbers"));
  json behind = astra_vectors(scan.setup)["Vectors"];
  // The detector between the source and the axis' far side: the source looks away from the axis.
  for (std::size_t i = 0; i < 3; ++i) behind[4][3 + i] = 2 * behind[4][i].get<double>();
  BOOST_TEST(has(with({{"Vectors", behind}}), "view 4: the isocentre lies on or behind"));
  for (std::size_t i = 0; i < 3; ++i) behind[4][9 + i] = behind[4][6 + i];
  BOOST_TEST(has(with({{"Vectors", behind}}), "view 4"));
}

// TIGRE's own lines: source and detector turned by the angle, then moved by COR along the turned y.
BOOST_AUTO_TEST_CASE(truncated_files_of_geometry_are_refused_at_every_length) {
  const Scan scan;
  const std::string xml = rtk_text(scan.setup),
                    npy = npy_bytes(matrices_of(scan.read(scan.geometry())), "12, 3, 4");
  const auto root_end = xml.rfind('>');
  for (std::size_t n = 0; n <= root_end; ++n)
    BOOST_REQUIRE_THROW(static_cast<void>(io::rtk_geometry(scan.folder.file("cut", xml.substr(0, n)), {},
                                                           {views, rows, columns})),
                        FileError);
  for (std::size_t n = 0; n < npy.size(); ++n)
    BOOST_REQUIRE_THROW(static_cast<void>(io::read_npy(scan.folder.file("cut", npy.substr(0, n)))),
                        FileError);
}

BOOST_AUTO_TEST_CASE(xml_that_geometry_has_no_use_for_is_refused_with_its_line) {
  const TemporaryFolder folder;
  const auto with_text = [&](const std::string& text) {
    try {
      static_cast<void>(io::rtk_geometry(folder.file("g.xml", text), {}, {1, rows, columns}));
    } catch (const FileError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const auto with = [&](const std::string& angle, const std::string& before = "",
                        const std::string& after = "") {
    return with_text(before +
                     "<RTKThreeDCircularGeometry version='3'><SourceToIsocenterDistance>1e2<!-- c -->"
                     "</SourceToIsocenterDistance><SourceToDetectorDistance> 150 </SourceToDetectorDistance>"
                     "\n<Projection><GantryAngle>" +
                     angle + "</GantryAngle></Projection>\n</RTKThreeDCircularGeometry>\n" + after);
  };
  BOOST_TEST(with("1", "<?xml version='1.0'?><!DOCTYPE RTKGEOMETRY>", "<!-- end -->") == "accepted");
  // What a document type says of entities is not looked at, and nothing else is opened.
  BOOST_TEST(
      has(with("&x;", "<!DOCTYPE a [<!ENTITY x \"1\">]>"), "line 2: GantryAngle is '&x;', not a number"));
  BOOST_TEST(has(with("&x;", "<!DOCTYPE a SYSTEM \"b.dtd\">"), "not a number"));
  for (const char* text : {"1<!-- c -->2", "1<b/>", "<![CDATA[1]]>", "1 2", ""})
    BOOST_TEST(has(with(text), "line 2: GantryAngle is"), text);
  BOOST_TEST(has(with("1", "", "<b/>"), "line 4: something follows the root"));
  BOOST_TEST(has(with_text("<a>\n</b>"), "line 2: "));
  std::string deep, flat = "<a>";
  for (int i = 0; i < 1'000'000; ++i) deep += "<a>";
  for (int i = 0; i < 1'100'000; ++i) flat += "<b/>";
  BOOST_TEST(has(with_text(deep), "truncated"));
  BOOST_TEST(has(with_text(flat + "</a>"), "more than 1048576 tags"));
}

BOOST_AUTO_TEST_CASE(npy_files_of_other_kinds_are_refused) {
  const TemporaryFolder folder;
  const std::string good = npy_bytes(std::vector<double>(12, 1), "1, 3, 4");
  const auto with = [&](const std::string& part, const std::string& instead) {
    std::string bytes = good;
    bytes.replace(bytes.find(part), part.size(), instead);
    try {
      static_cast<void>(io::read_npy(folder.file("a.npy", bytes)));
    } catch (const FileError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  BOOST_TEST(with("<f8", "<f8") == "accepted");
  BOOST_TEST(has(with("<f8", ">f8"), "'>f8'"));
  BOOST_TEST(has(with("<f8", "|O8"), "'|O8'"));
  BOOST_TEST(has(with("1, 3, 4", "1, 3, 5"), "take 120 bytes"));
  BOOST_TEST(has(with("1, 3, 4", "-1, 3, 4"), "lengths"));
  BOOST_TEST(has(with("1, 3, 4", "99999999999999999999, 3, 4"), "too long"));
  BOOST_TEST(has(with("False", "maybe"), "fortran_order"));
  BOOST_TEST(has(with("'shape'", "'shade'"), "'shade'"));
}
