// Cone beam from the distances of an NXtomo file.
#define BOOST_TEST_MODULE nxtomo_beam
#include <boost/test/unit_test.hpp>

#include "tests/support/cone_files.hpp"
#include "vdvr/expert/exact_field.hpp"

using namespace vdvr;
using namespace vdvr::support;

namespace {

const std::string instrument = nxtomo_entry + "/instrument", sample = nxtomo_entry + "/sample",
                  detector = instrument + "/ccd", of_source = instrument + "/source/distance",
                  of_detector = detector + "/distance";

// One number with its unit, besides those of write_nxtomo (pixels of 0.5 x 0.75 mm; 4 views over 135
// degrees).
struct Field {
  std::string object;
  std::vector<double> values;
  std::string units = "mm";
};

const std::vector<Field> distances{{of_source, {-50}}, {of_detector, {25}}};

Path nxtomo(const TemporaryFolder& folder, const std::vector<Field>& fields,
            const std::function<void(Hdf5Writer&)>& more = {}) {
  return write_nxtomo(folder / "scan.nxs", {2, 1, 0, 0, 3, 0, 1, 0}, [&](Hdf5Writer& file) {
    // A full turn instead of what it wrote.
    H5Ldelete(file.id(), (sample + "/rotation_angle").c_str(), H5P_DEFAULT);
    file.dataset(sample + "/rotation_angle", {8}, {0, 0, 0, 90, 9, 180, 9, 270}, H5T_IEEE_F64LE);
    for (const Field& f : fields) {
      file.dataset(f.object, {f.values.size()}, f.values, H5T_IEEE_F64LE);
      if (!f.units.empty()) file.attribute(f.object, "units", f.units);
    }
    if (more) more(file);
  });
}

ScanOptions cone() {
  ScanOptions options;
  options.beam = Beam::cone;
  return options;
}

ProjectionSet read(const TemporaryFolder& folder, const std::vector<Field>& fields,
                   const ScanOptions& options = cone()) {
  return read_scan(nxtomo(folder, fields), options);
}

std::vector<Field> with(std::vector<Field> fields, const Field& more) {
  std::erase_if(fields, [&](const Field& f) { return f.object == more.object; });
  if (!more.values.empty()) fields.push_back(more);
  return fields;
}

}  // namespace

BOOST_AUTO_TEST_CASE(nxtomo_of_distances_is_the_circular_scan_of_scan_json_to_the_bit) {
  const TemporaryFolder folder;
  const ProjectionSet plain = read(folder, distances);
  const auto describe = [&](const json& members) {
    json whole{{"hdf5", "scan.nxs"}};
    whole.update(members);
    static_cast<void>(folder.file("scan.json", whole.dump()));
    return folder.path();
  };
  const json numbers{{"source_to_axis", 50}, {"source_to_detector", 75}, {"pitch", {0.5, 0.75}}};
  const ProjectionSet stated = read_scan(describe({{"geometry", numbers}}));
  BOOST_REQUIRE(plain.cone.has_value());
  BOOST_TEST((plain.cone->views == stated.cone->views));
  BOOST_TEST((plain.cone->redundancy == stated.cone->redundancy));
  BOOST_TEST(std::equal(plain.data.begin(), plain.data.end(), stated.data.begin(), stated.data.end()));
  BOOST_TEST(plain.geometry.unit == "mm");
  BOOST_TEST(stated.geometry.unit == "mm");
  BOOST_TEST(plain.report.source_to_detector == 75);
  BOOST_TEST(plain.report.center_source == "default");
  const std::vector<Vec3> points{{0, 0, 0}, {0.2, -0.1, 0.1}, {-0.15, 0.25, -0.2}};
  BOOST_TEST((ExactField(plain, {}).at(points) == ExactField(stated, {}).at(points)));
  // The same asked for by scan.json, and beside it.
  for (const ProjectionSet& asked :
       {read_scan(describe({{"beam", "cone"}})), read_scan(describe({{"beam", "cone"}}), cone()),
        read_scan(describe(json::object()), cone())}) {
    BOOST_TEST((asked.cone->views == plain.cone->views));
    BOOST_TEST((asked.report.notes == plain.report.notes));
  }
  for (const char* note :
       {"source to axis 50 mm", "/source/distance = -50 mm whatever its sign", "axis to detector 25 mm",
        "sides of a pixel on the detector, 0.5 x 0.75 mm", "at the axis 0.333", "middle column, 1",
        "middle row, 0.5", "sense of rotation assumed"})
    BOOST_TEST(noted(plain, note), note);
}

BOOST_AUTO_TEST_CASE(nxtomo_is_parallel_beam_unless_cone_is_asked_for) {
  const TemporaryFolder folder;
  ScanOptions parallel;
  parallel.beam = Beam::parallel;
  for (const ScanOptions& options : {ScanOptions{}, parallel}) {
    const ProjectionSet scan = read(folder, distances, options);
    BOOST_TEST(!scan.cone.has_value());
    BOOST_TEST(scan.geometry.views() == K);
  }
}

BOOST_AUTO_TEST_CASE(nxtomo_lengths_are_brought_to_the_unit_of_the_pixels) {
  const TemporaryFolder folder;
  const ProjectionSet plain = read(folder, distances);
  for (const auto& [unit, factor] : std::vector<std::pair<std::string, double>>{
           {"m", 1e-3}, {"", 1e-3}, {"cm", 0.1}, {"um", 1e3}, {"\u00b5m", 1e3}, {"micron", 1e3}, {"nm", 1e6}})
    BOOST_TEST(largest_difference(plain, read(folder, {{of_source, {-50 * factor}, unit},
                                                       {of_detector, {25 * factor}, unit}})) <=
               same_geometry);
  // Some writers give the source's distance without its sign, and a number for each frame.
  BOOST_TEST(
      (read(folder, {{of_source, {50, 50, 50}}, {of_detector, {25}}}).cone->views == plain.cone->views));
}

BOOST_AUTO_TEST_CASE(nxtomo_axis_is_read_as_a_place_or_as_an_offset) {
  const TemporaryFolder folder;
  const std::string column = detector + "/x_rotation_axis_pixel_position",
                    older = detector + "/estimated_cor_from_motor",
                    row = detector + "/y_rotation_axis_pixel_position";
  // Three columns, whose middle is 1; two rows, whose middle is 0.5.
  for (const auto& [object, value, center, says] :
       std::vector<std::tuple<std::string, double, double, std::string>>{
           {column, 1.25, 1.25, "read as a column"},
           {older, 1.25, 1.25, "read as a column"},
           {column, 0.125, 1.125, "read as an offset from the middle"},
           {column, -0.25, 0.75, "read as an offset from the middle"}}) {
    const ProjectionSet scan = read(folder, with(distances, {object, {value}, ""}));
    BOOST_TEST(cone_view(scan.cone->views[1]).center == center, boost::test_tools::tolerance(same_geometry));
    BOOST_TEST(scan.report.center_source == "file");
    BOOST_TEST(noted(scan, says));
    BOOST_TEST(noted(scan, "readers differ"));
  }
  const ProjectionSet high = read(folder, with(distances, {row, {0.75}, ""}));
  BOOST_TEST(cone_view(high.cone->views[0]).row == 0.75, boost::test_tools::tolerance(same_geometry));
  // Of a half acquisition the axis lies near the edge.
  const auto half = [&](const std::function<void(Hdf5Writer&)>& more) {
    ScanOptions options = cone();
    return read_scan(nxtomo(folder, with(distances, {column, {0.875}, ""}), more), options);
  };
  BOOST_TEST(half({}).report.center_source == "file");
  BOOST_TEST(noted(half({}), "read as a column"));
  // As h5py writes True, and as a whole number.
  const ProjectionSet edge = half([&](Hdf5Writer& file) {
    const hid_t type = H5Tenum_create(H5T_STD_I8LE), space = H5Screate(H5S_SCALAR);
    const std::int8_t no = 0, yes = 1;
    H5Tenum_insert(type, "FALSE", &no);
    H5Tenum_insert(type, "TRUE", &yes);
    const hid_t set = H5Dcreate2(file.id(), (detector + "/half_acquisition").c_str(), type, space,
                                 H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &yes);
    H5Dclose(set);
    H5Sclose(space);
    H5Tclose(type);
  });
  for (const auto& [number, says] : {std::pair{1.0, "read as an offset"}, {0.0, "read as a column"}})
    BOOST_TEST(noted(half([&, value = number](Hdf5Writer& file) {
                       file.dataset(detector + "/half_acquisition", {1}, {value}, H5T_STD_U8LE);
                     }),
                     says));
  BOOST_TEST(noted(edge, "read as an offset"));
  BOOST_TEST(edge.geometry.center == 1.875, boost::test_tools::tolerance(same_geometry));
  BOOST_TEST(has(refusal(nxtomo(folder, with(distances, {column, {17}, ""})), cone()),
                 "x_rotation_axis_pixel_position: is 17, which is neither"));
  ScanOptions moved = cone();
  moved.center = 0.875;
  const ProjectionSet scan = read(folder, with(distances, {column, {1.25}, ""}), moved);
  BOOST_TEST(scan.report.center_source == "option");
  BOOST_TEST(scan.geometry.center == 0.875, boost::test_tools::tolerance(same_geometry));
}

BOOST_AUTO_TEST_CASE(nxtomo_distances_that_say_nothing_are_refused_by_name) {
  const TemporaryFolder folder;
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const auto& [field, says] : std::vector<std::pair<Field, std::string>>{
           {{of_source, {}}, "source/distance: is missing; it is the distance from the source to the sample"},
           {{of_detector, {}},
            "ccd/distance: is missing; it is the distance from the sample to the detector"},
           {{of_source, {0}}, "source/distance: is 0"},
           {{of_detector, {0}}, "ccd/distance: is 0"},
           {{of_detector, {-25}}, "ccd/distance: is -25 mm: the detector would lie before the sample"},
           {{of_source, {nan}}, "source/distance: is nan"},
           {{of_detector, {inf}}, "ccd/distance: is inf"},
           {{of_source, {-50, -51}}, "varies from -51 to -50"},
           {{of_source, {-50}, "furlong"}, "units 'furlong'"}})
    BOOST_TEST(has(refusal(nxtomo(folder, with(distances, field)), cone()), says));
  // A sample that climbs is a helix; one that trembles is not.
  const std::string height = sample + "/z_translation";
  BOOST_TEST(has(refusal(nxtomo(folder, with(distances, {height, {0, 0, 0, 1, 9, 2, 9, 3}})), cone()),
                 "z_translation: the sample moves by 3 mm"));
  BOOST_TEST(refusal(nxtomo(folder, with(distances, {height, {9, 9, 1, 1.0625, 9, 1, 9, 1}})), cone()) ==
             "accepted");
}

BOOST_AUTO_TEST_CASE(nxtomo_without_pixel_sizes_is_no_cone_beam) {
  const TemporaryFolder folder;
  const Path path = nxtomo(folder, distances);
  {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    H5Ldelete(file, (detector + "/y_pixel_size").c_str(), H5P_DEFAULT);
    H5Fclose(file);
  }
  BOOST_TEST(refusal(path) == "accepted");
  BOOST_TEST(has(refusal(path, cone()), "y_pixel_size: is missing"));
}

BOOST_AUTO_TEST_CASE(cone_that_nothing_tells_of_is_refused) {
  const TemporaryFolder folder;
  BOOST_TEST(has(refusal(write_exchange(folder / "p.h5", {}), cone()), "Data Exchange states no distances"));
  static_cast<void>(nxtomo(folder, distances));
  const json geometry{{"source_to_axis", 50}, {"source_to_detector", 75}, {"pitch", 0.5}};
  const auto refused = [&](const json& members, const ScanOptions& options) {
    static_cast<void>(folder.file("scan.json", members.dump()));
    return refusal(folder.path(), options);
  };
  BOOST_TEST(has(refused({{"hdf5", "scan.nxs"}, {"geometry", geometry}}, cone()), "leave `beam` out"));
  BOOST_TEST(has(refused({{"hdf5", "scan.nxs"}, {"geometry", geometry}, {"beam", "cone"}}, {}),
                 "'geometry' and 'beam' both describe"));
  BOOST_TEST(has(refused({{"hdf5", "scan.nxs"}, {"beam", "fan"}}, {}), "'beam' is \"fan\""));
  BOOST_TEST(has(refused({{"hdf5", "scan.nxs"}, {"beam", "parallel"}}, cone()), "asks for cone"));
  BOOST_TEST(refused({{"hdf5", "scan.nxs"}, {"beam", "parallel"}}, {}) == "accepted");
  BOOST_TEST(has(refused({{"hdf5", "p.h5"}, {"beam", "cone"}}, {}), "Data Exchange states no distances"));
  BOOST_TEST(has(refused({{"hdf5", "scan.nxs"}, {"beam", "cone"}, {"pitch", 1}}, {}), "'pitch'"));
  BOOST_TEST(has(refused({{"hdf5", "scan.nxs"}, {"beam", "cone"}, {"angles", {0, 1, 2, 3}}}, {}),
                 "'angles' contradicts 'beam'"));
  json stack{{"projections", "stack.mha"}, {"description", "line integrals"}, {"angles", {0, 90}}};
  static_cast<void>(folder.file("stack.mha", stack_bytes(4, 3, 2, "")));
  BOOST_TEST(has(refused(stack, cone()), "read from an NXtomo file ('hdf5')"));
  stack["beam"] = "cone";
  BOOST_TEST(has(refused(stack, {}), "read from an NXtomo file ('hdf5')"));
  ScanOptions with_angles = cone();
  with_angles.angles_file = folder.file("angles.txt", "0\n90\n");
  BOOST_TEST(has(refusal(folder / "stack.mha", with_angles), "a stack states no distances"));
}
