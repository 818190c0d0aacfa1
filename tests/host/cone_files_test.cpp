// Cone-beam geometry from files: the same scan written in every form, RTK's own numbers.
#define BOOST_TEST_MODULE cone_files
#include <boost/test/unit_test.hpp>
#include <optional>
#include <sstream>

#include "tests/support/cone_files.hpp"
#include "tests/support/places.hpp"
#include "vdvr/expert/hash.hpp"

using namespace vdvr;
using namespace vdvr::support;

extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

// --- one scan in every form ---

BOOST_AUTO_TEST_CASE(every_form_of_one_geometry_gives_the_same_matrices) {
  const Scan scan;
  const ProjectionSet plain = scan.read(scan.geometry());
  BOOST_TEST(plain.geometry.views() == views);
  BOOST_TEST(plain.data[0] == 1);
  BOOST_TEST(plain.report.center_source == "file");
  BOOST_TEST(plain.report.source_to_detector == 150);

  static_cast<void>(scan.folder.file("P.npy", npy_bytes(matrices_of(plain, -7), "12, 3, 4")));
  BOOST_TEST(largest_difference(plain, scan.read({{"matrices", "P.npy"}})) <= same_geometry);
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const ProjectionSet rtk = scan.read({{"rtk_geometry", "g.xml"}});
  BOOST_TEST(largest_difference(plain, rtk) <= same_geometry);
  BOOST_TEST(rtk.geometry.unit == "mm");
  BOOST_TEST(rtk.report.source_to_detector == 150);
  static_cast<void>(scan.folder.file("a.json", astra_vectors(scan.setup).dump()));
  BOOST_TEST(largest_difference(plain, scan.read({{"astra", "a.json"}})) <= same_geometry);
}

BOOST_AUTO_TEST_CASE(rows_of_the_matrices_see_points_where_rays_hit_the_detector) {
  const Scan scan;
  const Setup& s = scan.setup;
  const ProjectionSet plain = scan.read(scan.geometry());
  const Axes a = rotated_axes(s.angles()[5], s.in_deg, s.out_deg);
  // A pixel's place in space, and a point on the way to it from the source.
  const double column = 6, row = 1, part = 0.625;
  Vec3 point{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double source = s.sid * a[2][i];
    const double pixel = (s.sid - s.sdd) * a[2][i] + (column - s.center) * s.pitch_u * a[0][i] +
                         (row - s.row) * s.pitch_v * a[1][i];
    point[i] = source + part * (pixel - source);
  }
  const ViewMatrix& m = plain.cone->views[5];
  double n[3];
  for (std::size_t i = 0; i < 3; ++i)
    n[i] = m[i][0] * point[0] + m[i][1] * point[1] + m[i][2] * point[2] + m[i][3];
  BOOST_TEST(std::abs(n[0] / n[2] - column) <= tolerance::fp64_sum(100, columns * s.sdd));
  BOOST_TEST(std::abs(n[1] / n[2] - row) <= tolerance::fp64_sum(100, columns * s.sdd));
  BOOST_TEST(std::abs(n[2] - part * s.sdd / s.sid) <= tolerance::fp64_sum(100, 2));
}

BOOST_AUTO_TEST_CASE(astra_cone_is_a_plain_circle_of_the_detectors_middle) {
  Setup s;
  s.center = 3.5;
  s.row = 2.5;
  s.in_deg = s.out_deg = 0;
  const Scan scan(s);
  std::vector<double> angles = s.angles();
  for (double& angle : angles) angle *= radians;
  const json astra{{"type", "cone"},
                   {"DetectorSpacingX", s.pitch_u},
                   {"DetectorSpacingY", s.pitch_v},
                   {"DetectorRowCount", rows},
                   {"DetectorColCount", columns},
                   {"ProjectionAngles", angles},
                   {"DistanceOriginSource", s.sid},
                   {"DistanceOriginDetector", s.sdd - s.sid}};
  static_cast<void>(scan.folder.file("a.json", astra.dump()));
  const ProjectionSet plain = scan.read({{"astra", "a.json"}});
  BOOST_TEST(largest_difference(plain, scan.read(scan.geometry())) <= same_geometry);
  static_cast<void>(scan.folder.file("v.json", astra_vectors(s).dump()));
  BOOST_TEST(largest_difference(plain, scan.read({{"astra", "v.json"}})) <= same_geometry);
}

BOOST_AUTO_TEST_CASE(matrices_are_read_in_both_orders_and_both_widths) {
  const Scan scan;
  const ProjectionSet plain = scan.read(scan.geometry());
  const std::vector<double> c = matrices_of(plain);
  std::vector<double> f;
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < views; ++k) f.push_back(c[12 * k + 4 * i + j]);
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(f, "12, 3, 4", true)));
  BOOST_TEST(largest_difference(plain, scan.read({{"matrices", "P.npy"}})) <= same_geometry);
  const std::vector<float> narrow(c.begin(), c.end());
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(narrow, "12, 3, 4")));
  BOOST_TEST(largest_difference(plain, scan.read({{"matrices", "P.npy"}})) <= tolerance::unit_roundoff * 4);
}

BOOST_AUTO_TEST_CASE(rtk_documentations_example_is_read_as_its_matrices_say) {
  const TemporaryFolder folder;
  static_cast<void>(
      folder.file("stack.mha", stack_bytes(4, 3, 2, "Offset = -300 -200 0\nElementSpacing = 200 150 1\n")));
  const std::string text = R"(<?xml version="1.0"?>
<!DOCTYPE RTKGEOMETRY>
<RTKThreeDCircularGeometry version="3">
  <SourceToIsocenterDistance>1000</SourceToIsocenterDistance>
  <SourceToDetectorDistance>1536</SourceToDetectorDistance>
  <Projection>
    <GantryAngle>271.847274780273</GantryAngle>
    <ProjectionOffsetX>-117.056503295898</ProjectionOffsetX>
    <ProjectionOffsetY>-1.01195001602173</ProjectionOffsetY>
    <Matrix>
          -166.5093078829                   0   -1531.42837748039   -117056.503295898
        -1.01142410874151               -1536  0.0326206557691505   -1011.95001602173
       -0.999480303105996                   0  0.0322354417240802               -1000
    </Matrix>
  </Projection>
  <Projection>
    <GantryAngle>271.852905273438</GantryAngle>
    <ProjectionOffsetX>-117.056831359863</ProjectionOffsetX>
    <ProjectionOffsetY>-1.01187002658844</ProjectionOffsetY>
    <Matrix>
        -166.660129424325                   0   -1531.41199650136   -117056.831359863
        -1.01134095059569               -1536  0.0327174625589984   -1011.87002658844
       -0.999477130482326                   0  0.0323336611415466               -1000
    </Matrix>
  </Projection>
</RTKThreeDCircularGeometry>
)";
  const double first[3][4] = {{-166.5093078829, 0, -1531.42837748039, -117056.503295898},
                              {-1.01142410874151, -1536, 0.0326206557691505, -1011.95001602173},
                              {-0.999480303105996, 0, 0.0322354417240802, -1000}};
  static_cast<void>(folder.file("g.xml", text));
  static_cast<void>(folder.file(
      "scan.json", R"({"projections": "stack.mha", "description": "line integrals", "rtk_geometry": "g.xml",
                       "redundancy": "full-turn"})"));
  const ProjectionSet scan = read_scan(folder.path());
  const ViewMatrix& m = scan.cone->views[0];
  // RTK's x, y, z is our x, z, -y; a length on its detector is origin + pixel * spacing of the stack.
  const double origin[2] = {-300, -200}, spacing[2] = {200, 150};
  for (std::size_t i = 0; i < 3; ++i)
    for (const auto& [ours, theirs, sign] :
         {std::tuple<std::size_t, std::size_t, double>{0, 0, 1}, {1, 2, -1}, {2, 1, 1}, {3, 3, 1}}) {
      const double length = i < 2 ? m[i][ours] * spacing[i] + origin[i] * m[2][ours] : m[2][ours];
      // Fifteen digits are in the file.
      BOOST_TEST(std::abs(-1000 * length - sign * first[i][theirs]) <= 1e-14 * 1.2e5, i << " " << ours);
    }
  for (const auto& [part, broken, says] : std::vector<std::array<std::string, 3>>{
           {"-166.5093078829", "-166.5113078829", "view 0: entry [0][0] of Matrix"},
           {"-1000\n    </Matrix>\n  </Projection>\n</RTK", "-1000 1\n    </Matrix>\n  </Projection>\n</RTK",
            "3 x 4"},
           {"<Projection>", "<RadiusCylindricalDetector>1536</RadiusCylindricalDetector><Projection>",
            "1536"},
           {"<Projection>", "<Projection><CollimationUInf>20</CollimationUInf>", "CollimationUInf is 20"},
           {"<SourceToDetectorDistance>1536", "<SourceToDetectorDistance>0", "parallel beam"},
           {"<SourceToIsocenterDistance>1000", "<SourceToIsocenterDistance>-1000", "isocentre"},
           {"<SourceToIsocenterDistance>1000", "<SourceToIsocenterDistance>1O00", "not a number"},
           {"version=\"3\"", "version=\"1\"", "version '1'"},
           {"<GantryAngle>271.85", "<HelixAngle>1</HelixAngle><GantryAngle>271.85", "HelixAngle"},
           {"RTKThreeDCircularGeometry version", "Geometry version", "mismatch"}}) {
    std::string damaged = text;
    damaged.replace(damaged.find(part), part.size(), broken);
    static_cast<void>(folder.file("g.xml", damaged));
    BOOST_TEST(has(refusal(folder.path()), says));
  }
}

BOOST_AUTO_TEST_CASE(rtk_parameters_hold_until_they_are_given_again_as_in_rtk) {
  const Scan scan;
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const ProjectionSet once = scan.read({{"rtk_geometry", "g.xml"}});
  static_cast<void>(
      scan.folder.file("g.xml", rtk_text(scan.setup, "<CollimationUInf>1e308</CollimationUInf>\n",
                                         "<InPlaneAngle>2</InPlaneAngle><!-- again -->")));
  BOOST_TEST(largest_difference(once, scan.read({{"rtk_geometry", "g.xml"}})) == 0);
}

// NXtomo of the documentation's numbers.
static void write_distances(const Path& path) {
  Hdf5Writer file(path);
  for (const char* group : {"/entry", "/entry/instrument", "/entry/instrument/detector",
                            "/entry/instrument/source", "/entry/sample"})
    file.group(group);
  std::vector<double> frames(6 * 256 * 256, 30000);
  std::fill_n(frames.begin(), 256 * 256, 10);
  std::fill_n(frames.begin() + 256 * 256, 256 * 256, 60000);
  file.dataset("/entry/instrument/detector/data", {6, 256, 256}, frames);
  file.dataset("/entry/instrument/detector/image_key", {6}, {2, 1, 0, 0, 0, 0}, H5T_STD_I32LE);
  file.dataset("/entry/sample/rotation_angle", {6}, {0, 0, 0, 90, 180, 270}, H5T_IEEE_F64LE);
  for (const auto& [name, value] : {std::pair{"/entry/instrument/detector/x_pixel_size", 0.2},
                                    {"/entry/instrument/detector/y_pixel_size", 0.2},
                                    {"/entry/instrument/detector/distance", 500.0},
                                    {"/entry/instrument/source/distance", -500.0}}) {
    file.dataset(name, {1}, {value}, H5T_IEEE_F64LE);
    file.attribute(name, "units", "mm");
  }
}

// Blocks of docs/inputs.md, "Cone beam", as a user copies them: what begins with '{"proj', '{"hdf5' or
// '{"nikon' is a scan.json, the others are the files that it names.
BOOST_AUTO_TEST_CASE(examples_of_the_documentation_are_read) {
  const std::string text = support::bytes_of(Path(vdvr::support::source_dir) / "docs/inputs.md");
  std::istringstream lines(text.substr(text.find("## Cone beam\n")));
  std::vector<std::string> blocks;
  std::string line;
  for (bool within = false; std::getline(lines, line) && line.rfind("## From counts", 0) != 0;) {
    const bool code = line.rfind("    ", 0) == 0;
    if (code && !within) blocks.emplace_back();
    if (code) blocks.back() += line.substr(4) + "\n";
    within = code;
  }
  const TemporaryFolder folder;
  static_cast<void>(folder.file(
      "stack.mha", stack_bytes(256, 256, 4, "Offset = -25.5 -25.5 0\nElementSpacing = 0.2 0.2 1\n")));
  for (const char* name : {"view_0.tif", "view_1.tif", "view_2.tif", "view_3.tif", "flat.tif", "dark.tif"})
    write_tiff(folder / name, 256, 256,
               std::vector<std::uint16_t>(256 * 256, name[0] == 'f'   ? 60000
                                                     : name[0] == 'd' ? 10
                                                                      : 30000),
               SAMPLEFORMAT_UINT);
  static_cast<void>(folder.file("angles.txt", "0 90 180 270\n"));
  write_distances(folder / "scan.nxs");
  std::optional<ProjectionSet> first;
  std::size_t read = 0;
  const auto check = [&](const std::string& scan) {
    static_cast<void>(folder.file("scan.json", scan));
    const ProjectionSet one = read_scan(folder.path());
    BOOST_TEST(one.cone->views.size() == 4u);
    BOOST_TEST(one.report.source_to_detector ==
               (scan.find("matrices") == std::string::npos && scan.find("vectors.json") == std::string::npos
                    ? 1000
                    : 0));
    if (!first) first = one;
    static_cast<void>(folder.file("P.npy", npy_bytes(matrices_of(*first), "4, 3, 4")));
    ++read;
  };
  const auto describes = [](const std::string& block) {
    return block.rfind("{\"proj", 0) == 0 || block.rfind("{\"nikon", 0) == 0 ||
           block.rfind("{\"hdf5", 0) == 0;
  };
  std::string scan;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::string& block = blocks[i];
    const bool described = describes(block);
    if (described) scan = block;
    // The files that a description names follow it.
    const bool file_follows = i + 1 < blocks.size() && !describes(blocks[i + 1]);
    if (described && !file_follows) check(scan);
    if (described) continue;
    if (block.rfind("<RTK", 0) == 0) static_cast<void>(folder.file("geometry.xml", block));
    else if (block.rfind("[XTekCT]", 0) == 0) static_cast<void>(folder.file("scan.xtekct", block));
    else if (block.find("\"mode\"") != std::string::npos) static_cast<void>(folder.file("tigre.json", block));
    else if (block.find("\"sod\"") != std::string::npos) static_cast<void>(folder.file("leap.json", block));
    else if (block.find("\"source_position\"") != std::string::npos)
      static_cast<void>(folder.file("cil.json", block));
    else static_cast<void>(folder.file("astra.json", block));
    if (block.find("cone_vec") != std::string::npos) {
      static_cast<void>(folder.file("vectors.json", block));
      scan.replace(scan.find("astra.json"), 10, "vectors.json");
    }
    check(scan);
  }
  BOOST_TEST(read == 10u);
}

// --- what is assumed, and who wins ---

BOOST_AUTO_TEST_CASE(defaults_are_the_detectors_middle_and_are_noted) {
  const Scan scan;
  const ProjectionSet plain = scan.read(
      scan.geometry({{"center", nullptr}, {"row", nullptr}, {"sense", nullptr}, {"tilt", nullptr}}));
  BOOST_TEST(plain.report.center_source == "default");
  BOOST_TEST(std::abs(plain.geometry.center - 3.5) <= same_geometry);
  BOOST_TEST(noted(plain, "sense of rotation assumed"));
  BOOST_TEST(noted(plain, "middle column, 3.5"));
  BOOST_TEST(noted(plain, "middle row, 2.5"));
  BOOST_TEST(std::abs(plain.geometry.pitch_u - 0.4 * 100 / 150) <= same_geometry);
  // At angle theta the source is at R (sin, -cos).
  const double theta = 35 * radians;
  const ConeView view = cone_view(plain.cone->views[1]);
  BOOST_TEST(std::abs(view.source[0] - 100 * std::sin(theta)) <= same_geometry * 100);
  BOOST_TEST(std::abs(view.source[1] + 100 * std::cos(theta)) <= same_geometry * 100);
}

BOOST_AUTO_TEST_CASE(sense_minus_one_turns_the_other_way) {
  const Scan scan;
  std::vector<double> negative = scan.setup.angles();
  for (double& a : negative) a = -a;
  BOOST_TEST(largest_difference(scan.read(scan.geometry({{"sense", -1}})),
                                scan.read(scan.geometry({{"angles", negative}}))) == 0);
}

BOOST_AUTO_TEST_CASE(offset_of_the_detector_moves_the_axis_to_lower_columns) {
  const Scan scan;
  BOOST_TEST(largest_difference(scan.read(scan.geometry({{"offset_u", 0.4}, {"offset_v", -0.5}})),
                                scan.read(scan.geometry({{"center", 2.25}, {"row", 3.75}}))) <=
             same_geometry);
}

BOOST_AUTO_TEST_CASE(center_option_moves_all_views_alike) {
  const Scan scan;
  ScanOptions options;
  options.center = 4;
  const ProjectionSet plain = scan.read(scan.geometry()), moved = scan.read(scan.geometry(), options);
  BOOST_TEST(moved.report.center_source == "option");
  BOOST_TEST(std::abs(moved.geometry.center - 4) <= same_geometry);
  const double shift = cone_view(moved.cone->views[0]).center - cone_view(plain.cone->views[0]).center;
  for (std::size_t k = 0; k < views; ++k)
    BOOST_TEST(std::abs(cone_view(moved.cone->views[k]).center - cone_view(plain.cone->views[k]).center -
                        shift) <= same_geometry * columns);
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(matrices_of(plain), "12, 3, 4")));
  const ProjectionSet stated = scan.read({{"matrices", "P.npy"}, {"center", 4}});
  BOOST_TEST(stated.report.center_source == "file");
  BOOST_TEST(largest_difference(stated, moved) <= same_geometry);
  BOOST_TEST(has(scan.refused({{"matrices", "P.npy"}, {"center", 9}}), "centre 9"));
}

// verify reads a scan with the centre of its certificate, and compares matrices.
BOOST_AUTO_TEST_CASE(a_centre_that_is_there_moves_nothing) {
  const Scan scan;
  for (const double center : {3.5, 4.1, 3.7, 2.9000000000000004}) {
    const auto members = scan.geometry({{"center", center}});
    const ProjectionSet plain = scan.read(members);
    ScanOptions options;
    for (const double again : {center, plain.geometry.center}) {
      options.center = again;
      BOOST_TEST((scan.read(members, options).cone->views == plain.cone->views), "centre " << center);
    }
  }
}

BOOST_AUTO_TEST_CASE(use_selects_views_with_their_geometry) {
  const Scan scan;
  json members = scan.geometry();
  const ProjectionSet whole = scan.read(members);
  members["use"] = {3, 12};
  const ProjectionSet part = scan.read(members);
  BOOST_TEST(part.cone->views.size() == 9u);
  BOOST_TEST((part.cone->views[0] == whole.cone->views[3]));
  BOOST_TEST(part.geometry.views() == 9);
}

BOOST_AUTO_TEST_CASE(redundancy_is_what_views_tell_unless_it_is_stated) {
  Setup s;
  s.center = 3.5;
  const Scan scan(s);
  BOOST_TEST((scan.read(scan.geometry()).cone->redundancy == Redundancy::full_turn));
  BOOST_TEST((scan.read(scan.geometry({{"center", 2.5}})).cone->redundancy == Redundancy::displaced));
  std::vector<double> open;
  for (int k = 0; k < views; ++k) open.push_back(18.0 * k);
  const ProjectionSet part = scan.read(scan.geometry({{"angles", open}}));
  BOOST_TEST((part.cone->redundancy == Redundancy::short_scan));
  BOOST_TEST(noted(part, "short-scan"));
  json stated = scan.geometry({{"angles", open}});
  stated["redundancy"] = "full-turn";
  BOOST_TEST((scan.read(stated).cone->redundancy == Redundancy::full_turn));
  stated["redundancy"] = "half";
  BOOST_TEST(has(scan.refused(stated), "'redundancy' is \"half\""));
}

BOOST_AUTO_TEST_CASE(short_scan_with_a_displaced_detector_is_refused) {
  Setup s;
  s.step_deg = 18;
  s.center = 2.5;
  const Scan scan(s);
  BOOST_TEST(has(scan.refused(scan.geometry()), "do not exist"));
  json stated = scan.geometry();
  stated["redundancy"] = "displaced";
  BOOST_TEST(has(scan.refused(stated), "do not exist"));
}

BOOST_AUTO_TEST_CASE(hash_covers_the_geometry_file) {
  const Scan scan;
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const ProjectionSet read = scan.read({{"rtk_geometry", "g.xml"}});
  std::vector<std::string> lines;
  for (const char* name : {"g.xml", "scan.json", "stack.mha"})
    lines.push_back(sha256_of_file(scan.folder / name) + " " + name + "\n");
  std::sort(lines.begin(), lines.end());
  BOOST_TEST(read.report.sha256 == sha256_of_text(lines[0] + lines[1] + lines[2]));
}

BOOST_AUTO_TEST_CASE(hdf5_brings_the_angles_of_a_circular_geometry) {
  const TemporaryFolder folder;
  Exchange e;
  e.white = false;
  e.description = "line integrals";
  e.theta = {0, 90, 180, 270};
  write_exchange(folder / "p.h5", e);
  const auto describe = [&](const json& geometry) {
    static_cast<void>(folder.file("scan.json", json{{"hdf5", "p.h5"}, {"geometry", geometry}}.dump()));
    return folder.path();
  };
  const json geometry{{"source_to_axis", 50}, {"source_to_detector", 100}, {"pitch", 1}};
  const ProjectionSet scan = read_scan(describe(geometry));
  BOOST_TEST(scan.cone->views.size() == 4u);
  BOOST_TEST(scan.geometry.unit == "pixel");
  BOOST_TEST(std::abs(cone_view(scan.cone->views[1]).source[0] - 50) <= same_geometry * 50);
  json more = geometry;
  more["angles"] = {0, 90, 180};
  BOOST_TEST(has(refusal(describe(more)), "3 angles for 4 projections"));
}

BOOST_AUTO_TEST_CASE(tiff_frames_take_any_geometry_but_rtks) {
  const TemporaryFolder folder;
  json description = write_folder(folder);
  description.erase("angles");
  description.erase("angle_range");
  description["geometry"] = {
      {"source_to_axis", 50}, {"source_to_detector", 100}, {"pitch", {1, 1}}, {"angles", {0, 90, 180, 270}}};
  static_cast<void>(folder.file("scan.json", description.dump()));
  const ProjectionSet scan = read_scan(folder.path());
  check_samples(scan);
  BOOST_TEST(scan.geometry.unit == "mm");
  BOOST_TEST(noted(scan, "assumed to be mm"));
  description.erase("geometry");
  description["rtk_geometry"] = "g.xml";
  BOOST_TEST(has(folder_refusal(folder, description), "one MetaImage stack"));
}

BOOST_AUTO_TEST_CASE(tigre_geometry_sees_points_where_tigres_rays_hit) {
  const Scan scan;
  std::vector<double> angles = scan.setup.angles();
  for (double& angle : angles) angle *= radians;
  const double sid = 100, sdd = 150, side_u = 0.4, side_v = 0.5, off_u = 0.3, off_v = -0.2, shift = 0.15;
  const json good{{"mode", "cone"},
                  {"DSD", sdd},
                  {"DSO", sid},
                  {"nDetector", {rows, columns}},
                  {"dDetector", {side_v, side_u}},
                  {"offDetector", {off_v, off_u}},
                  {"COR", shift},
                  {"angles", angles}};
  const auto with = [&](const json& change) {
    json tigre = good;
    tigre.update(change);
    static_cast<void>(scan.folder.file("t.json", tigre.dump()));
    return scan.refused({{"tigre", "t.json"}});
  };
  BOOST_TEST(with(json::object()) == "accepted");
  const ProjectionSet plain = read_scan(scan.folder.path());
  const double c = std::cos(angles[7]), s = std::sin(angles[7]), column = 6, row = 1, part = 0.6;
  const auto turned = [&](double x, double y, double z) {
    return Vec3{c * x - s * y - shift * s, s * x + c * y + shift * c, z};
  };
  // The row that is stored first is the one of the lowest z.
  const Vec3 source = turned(sid, 0, 0),
             pixel = turned(sid - sdd, side_u * (column - 0.5 * (columns - 1)) + off_u,
                            side_v * (row - 0.5 * (rows - 1)) + off_v);
  double n[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& m = plain.cone->views[7][i];
    n[i] = m[3];
    for (std::size_t a = 0; a < 3; ++a) n[i] += m[a] * (source[a] + part * (pixel[a] - source[a]));
  }
  BOOST_TEST(std::abs(n[0] / n[2] - column) <= tolerance::fp64_sum(100, columns * sdd));
  BOOST_TEST(std::abs(n[1] / n[2] - row) <= tolerance::fp64_sum(100, columns * sdd));

  json table = json::array();
  for (const double angle : angles) table.push_back({angle, 0, 0});
  BOOST_TEST(with({{"angles", table}, {"DSD", std::vector<double>(views, sdd)}}) == "accepted");
  BOOST_TEST(largest_difference(plain, read_scan(scan.folder.path())) == 0);
  table[3][1] = 0.1;
  BOOST_TEST(has(with({{"angles", table}}), "entry 3 turns about more"));
  BOOST_TEST(has(with({{"rotDetector", {0, 0.1, 0}}}), "'rotDetector' holds 0.1"));
  BOOST_TEST(has(with({{"mode", "parallel"}}), "'mode' is 'parallel'"));
  BOOST_TEST(has(with({{"nDetector", {columns, rows}}}), "'nDetector' is [8, 6]"));
  BOOST_TEST(has(with({{"DSO", {1, 2}}}), "'DSO' has 2 values"));
  BOOST_TEST(has(with({{"DSO", 0}}), "distance from source to axis is 0"));
}
