// TIFF frames, folders with scan.json, and MHA/NRRD stacks with an angles file.
#define BOOST_TEST_MODULE scan_folder
#include <boost/test/data/test_case.hpp>

#include "host/files/io/natural_order.hpp"
#include "host/scan/open/scan_folder.hpp"
#include "tests/support/scan_files.hpp"
#include "vdvr/expert/hash.hpp"

using namespace vdvr;
using namespace vdvr::support;

// Under AddressSanitizer: a size that a damaged file claims makes malloc fail, as it does without the
// sanitizer.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

// --- TIFF and folders ---

BOOST_AUTO_TEST_CASE(tiff_samples_of_every_type_are_read_to_the_bit) {
  const TemporaryFolder folder;
  for (const bool tiled : {false, true})
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW}) {
      check_tiff<std::uint8_t>(folder / "a.tif", SAMPLEFORMAT_UINT, tiled, compression);
      check_tiff<std::uint16_t>(folder / "a.tif", SAMPLEFORMAT_UINT, tiled, compression);
      check_tiff<std::uint32_t>(folder / "a.tif", SAMPLEFORMAT_UINT, tiled, compression);
      check_tiff<std::int8_t>(folder / "a.tif", SAMPLEFORMAT_INT, tiled, compression);
      check_tiff<std::int16_t>(folder / "a.tif", SAMPLEFORMAT_INT, tiled, compression);
      check_tiff<std::int32_t>(folder / "a.tif", SAMPLEFORMAT_INT, tiled, compression);
      check_tiff<float>(folder / "a.tif", SAMPLEFORMAT_IEEEFP, tiled, compression);
      check_tiff<double>(folder / "a.tif", SAMPLEFORMAT_IEEEFP, tiled, compression);
    }
}

BOOST_AUTO_TEST_CASE(truncated_tiff_is_refused_or_whole_at_every_length) {
  const TemporaryFolder folder;
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW}) {
    write_tiff(folder / "a.tif", 5, 7, std::vector<std::uint16_t>(35, 300), SAMPLEFORMAT_UINT, false,
               compression);
    const std::string whole = support::bytes_of(folder / "a.tif");
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const Path cut = folder.file("cut.tif", whole.substr(0, length));
      BOOST_REQUIRE_THROW(static_cast<void>(read_tiff(cut)), FileError);
    }
  }
}

BOOST_AUTO_TEST_CASE(tiff_that_is_no_single_grey_image_is_refused) {
  const TemporaryFolder folder;
  write_tiff(folder / "rgb.tif", 2, 2, std::vector<std::uint8_t>(12), SAMPLEFORMAT_UINT, false,
             COMPRESSION_NONE, 3);
  BOOST_CHECK_THROW(static_cast<void>(read_tiff(folder / "rgb.tif")), FileError);
  BOOST_CHECK_THROW(static_cast<void>(read_tiff(folder.file("text.tif", "not a picture"))), FileError);
  BOOST_CHECK_THROW(static_cast<void>(read_tiff(folder.path())), FileError);
  BOOST_CHECK_THROW(static_cast<void>(read_tiff(folder / "missing.tif")), FileError);
}

BOOST_AUTO_TEST_CASE(folder_is_read_in_natural_order) {
  const TemporaryFolder folder;
  nlohmann::json description = write_folder(folder);
  description["pitch"] = {0.5, 0.25};
  description["center"] = 1.25;
  description["unit"] = "mm";
  static_cast<void>(folder.file("scan.json", description.dump()));
  const ProjectionSet scan = read_scan(folder.path());
  check_samples(scan);
  BOOST_TEST(scan.geometry.pitch_v == 0.25);
  BOOST_TEST(scan.geometry.center == 1.25);
  BOOST_TEST(scan.geometry.theta_rad[3] == 135 * (pi / 180));
  description["use"] = {1, 3};
  static_cast<void>(folder.file("scan.json", description.dump()));
  const ProjectionSet part = read_scan(folder.path());
  ScanOptions two;
  two.input.views = view_ranges_of("0,2:");
  Understood understood;
  const ProjectionSet chosen = read_scan(folder.path(), two, {}, &understood);
  BOOST_TEST((understood.stated.views == ViewRanges{{0, 1}, {2, 4}}));
  BOOST_TEST(understood.frames.back().projection == 3);
  BOOST_TEST((std::vector<float>(chosen.data.begin() + V * U, chosen.data.end()) ==
              std::vector<float>(scan.data.begin() + 2 * V * U, scan.data.end())));
  BOOST_TEST(part.geometry.theta_rad ==
             std::vector<double>(scan.geometry.theta_rad.begin() + 1, scan.geometry.theta_rad.begin() + 3));
  BOOST_TEST((part.data == std::vector<float>(scan.data.begin() + V * U, scan.data.begin() + 3 * V * U)));
}

BOOST_AUTO_TEST_CASE(natural_order_counts) {
  BOOST_TEST(io::natural_less("a2", "a10"));
  BOOST_TEST(io::natural_less("a9b", "a10a"));
  BOOST_TEST(!io::natural_less("a10", "a2"));
  BOOST_TEST(io::natural_less("a002", "a10"));
  BOOST_TEST(io::natural_less("a", "a0"));
  BOOST_TEST(!io::natural_less("a1", "a1"));
  BOOST_TEST(io::natural_less("a01", "a1") != io::natural_less("a1", "a01"));
}

BOOST_AUTO_TEST_CASE(folder_with_wrong_members_is_refused_by_member) {
  const TemporaryFolder folder;
  const nlohmann::json good = write_folder(folder);
  const std::vector<std::pair<nlohmann::json, std::string>> changes{
      {{{"angle_range", {0, 3}}}, "3 angles for 4 projections"},
      {{{"angle_range", {2, 9}}}, "angle_range"},
      {{{"projections", "p/*.png"}}, "matches no file"},
      {{{"projections", "../*.tif"}}, "stay within"},
      {{{"flats", {"missing.tif"}}}, "missing.tif"},
      {{{"flats", true}}, "flats"},
      {{{"use", {3, 3}}}, "use"},
      {{{"use", {0, 5}}}, "use"},
      {{{"center", "middle"}}, "center"},
      {{{"center", 17}}, "centre 17"},
      {{{"pitch", {1, 0}}}, "pitch 0"},
      {{{"pitch", {1, 1, 1}}}, "pitch"},
      {{{"air_columns", {{0, 3}}}}, "air_columns"},
      {{{"air_columns", {{1, 1}}}}, "two columns"},
      {{{"unknown", 1}}, "unknown"},
      {{{"hdf5", "a.h5"}}, "one of"},
      {{{"angles", "dark.tif"}}, "dark.tif"},
      {{{"description", "photons"}}, "description"}};
  for (const auto& [change, part] : changes) {
    nlohmann::json description = good;
    description.update(change);
    BOOST_TEST(has(folder_refusal(folder, description), part));
  }
  nlohmann::json description = good;
  description.erase("darks");
  BOOST_TEST(has(folder_refusal(folder, description), "darks"));
  static_cast<void>(folder.file("scan.json", good.dump().substr(0, 40)));
  BOOST_TEST(has(refusal(folder.path()), "not JSON"));
  static_cast<void>(folder.file("scan.json", "[1]"));
  BOOST_TEST(has(refusal(folder.path()), "not a JSON object"));
}

BOOST_AUTO_TEST_CASE(blank_flat_and_odd_sized_projection_are_refused_by_name) {
  const TemporaryFolder folder;
  nlohmann::json description = write_folder(folder);
  write_tiff(folder / "blank.tif", V, U, std::vector<std::uint16_t>(V * U, 0), SAMPLEFORMAT_UINT);
  description["flats"] = {"flat.tif", "blank.tif"};
  BOOST_TEST(has(folder_refusal(folder, description), "blank.tif"));
  description["flats"] = {"flat.tif"};
  write_tiff(folder / "p/view_9.tif", V, U + 1, std::vector<float>(V * (U + 1), 500), SAMPLEFORMAT_IEEEFP);
  BOOST_TEST(has(folder_refusal(folder, description), "view_9.tif"));
}

// --- stacks ---

BOOST_AUTO_TEST_CASE(stack_is_read_with_its_angles_file) {
  const TemporaryFolder folder;
  const std::string header =
      "NDims = 3\nBinaryDataByteOrderMSB = False\nElementSpacing = 0.5 2 1\nDimSize = 3 1 2\nElementType = "
      "MET_UCHAR\nElementDataFile = LOCAL\n";
  const Path stack = folder.file("a.mha", header + "abcdef");
  ScanOptions options;
  BOOST_TEST(has(refusal(stack), "`angles_file`"));
  options.angles_file = folder.file("angles.txt", "0\n90\n");
  BOOST_TEST(has(refusal(stack, options), "`line_integrals`"));
  options.input.values = SampleValues::line_integrals;
  const ProjectionSet scan = read_scan(stack, options);
  BOOST_TEST(scan.geometry.rows == 1);
  BOOST_TEST(scan.geometry.columns == 3);
  BOOST_TEST(scan.geometry.pitch_v == 2);
  BOOST_TEST((scan.data == std::vector<float>{'a', 'b', 'c', 'd', 'e', 'f'}));
  BOOST_TEST(scan.report.sha256 == sha256_of_file(stack));
  BOOST_TEST(has(refusal(data / "aps-tooth", options), "angles file"));
  options.angles_file = folder.file("angles.txt", "0\n90\n180\n");
  BOOST_TEST(has(refusal(stack, options), "3 angles for the 2 views"));
  options.angles_file = folder.file("angles.txt", "0\nninety\n");
  BOOST_TEST(has(refusal(stack, options), "'ninety'"));
  options.angles_file = folder / "missing.txt";
  BOOST_TEST(has(refusal(stack, options), "missing.txt"));
  options.angles_file = folder.file("angles.txt", "0\n90\n");
  BOOST_TEST(has(refusal(folder.file("b.mha", header + "abcde"), options), "truncated"));
}
