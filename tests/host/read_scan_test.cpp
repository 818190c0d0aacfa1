#define BOOST_TEST_MODULE read_scan
#include "vdvr/read_scan.hpp"

#include "host/files/io/length_unit.hpp"
#include "host/files/io/text_encoding.hpp"
#include "tests/support/scan_files.hpp"
#include "vdvr/expert/hash.hpp"

using namespace vdvr;
using namespace vdvr::support;

// Under AddressSanitizer: a size that a damaged file claims makes malloc fail, as it does without the
// sanitizer.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

// --- the two real scans ---

BOOST_AUTO_TEST_CASE(diamond_is_read_with_air_at_zero) {
  const ProjectionSet scan = read_scan(data / "diamond-24737");
  const auto& g = scan.geometry;
  BOOST_TEST(g.views() == 90);
  BOOST_TEST(g.rows == 135);
  BOOST_TEST(g.columns == 160);
  BOOST_TEST(g.center == 85.85);
  BOOST_TEST(g.theta_rad.front() == -88.2 * (pi / 180));
  BOOST_TEST(scan.report.center_source == "file");
  BOOST_TEST(scan.report.format == "scan.json");
  BOOST_TEST(scan.report.name == "diamond-24737");
  BOOST_TEST(scan.report.air_background);
  BOOST_TEST(scan.report.dead_pixels == 90);  // pixel [0][0] of every frame
  // Least squares leave residuals whose mean is zero in each row, up to the rounding of 39 floats.
  double largest = 0;
  for (std::int64_t row = 0; row < g.views() * g.rows; ++row) {
    double sum = 0, magnitude = 0;
    for (std::int64_t i = 0; i < g.columns; ++i) {
      if (!((i >= 2 && i <= 24) || (i >= 142 && i <= 157))) continue;
      const double p = static_cast<double>(scan.data[static_cast<std::size_t>(row * g.columns + i)]);
      sum += p;
      magnitude += std::abs(p);
    }
    largest =
        std::max(largest, std::abs(sum) - tolerance::fp32_sum(1, magnitude) - tolerance::fp64_sum(1000, 39));
  }
  BOOST_TEST(largest <= 0);
}

BOOST_AUTO_TEST_CASE(scan_json_itself_names_the_same_scan) {
  const ProjectionSet a = read_scan(data / "aps-tooth"), b = read_scan(data / "aps-tooth" / "scan.json"),
                      c = read_scan(data / "aps-tooth/");
  BOOST_TEST(a.geometry.views() == 181);
  BOOST_TEST(a.geometry.rows == 2);
  BOOST_TEST(a.geometry.columns == 640);
  BOOST_TEST(a.geometry.center == 295.9);
  for (const ProjectionSet* other : {&b, &c}) {
    BOOST_TEST(a.report.name == other->report.name);
    BOOST_TEST(a.report.sha256 == other->report.sha256);
    BOOST_TEST((a.data == other->data));
  }
}

BOOST_AUTO_TEST_CASE(hash_of_a_folder_is_that_of_its_sorted_lines) {
  std::vector<std::string> lines;
  for (const char* name : {"scan.json", "tooth.h5"})
    lines.push_back(sha256_of_file(data / "aps-tooth" / name) + " " + name + "\n");
  std::sort(lines.begin(), lines.end());
  BOOST_TEST(read_scan(data / "aps-tooth").report.sha256 == sha256_of_text(lines[0] + lines[1]));
  BOOST_TEST(read_scan(data / "aps-tooth/tooth.h5").report.sha256 ==
             sha256_of_file(data / "aps-tooth/tooth.h5"));
}

BOOST_AUTO_TEST_CASE(tooth_without_a_description_finds_its_centre) {
  const ProjectionSet scan = read_scan(data / "aps-tooth/tooth.h5");
  BOOST_TEST(scan.report.format == "data-exchange");
  BOOST_TEST(scan.report.center_source == "found");
  BOOST_TEST(std::abs(scan.geometry.center - 295.9) <= 0.2);  // as its documentation gives it
  ScanOptions options;
  options.center = 300;
  BOOST_TEST(read_scan(data / "aps-tooth/tooth.h5", options).report.center_source == "option");
  options.center = 640;
  BOOST_TEST(has(refusal(data / "aps-tooth/tooth.h5", options), "centre 640"));
}

// --- Data Exchange ---

BOOST_AUTO_TEST_CASE(data_exchange_counts_become_line_integrals) {
  const TemporaryFolder folder;
  const ProjectionSet scan = read_scan(write_exchange(folder / "a.h5", {}));
  check_samples(scan);
  BOOST_TEST(scan.geometry.theta_rad[1] == 45 * (pi / 180));
  BOOST_TEST(scan.report.center_source == "default");
  BOOST_TEST(scan.geometry.center == 1);
  BOOST_TEST(scan.report.transmission_floor == 0x1p-17);
}

BOOST_AUTO_TEST_CASE(sinogram_order_is_read_as_the_file_says) {
  const TemporaryFolder folder;
  Exchange e;
  e.shape = {V, K, U};
  e.data = raw_counts(true);
  e.axes = "y:theta:x";
  check_samples(read_scan(write_exchange(folder / "a.h5", e)));
  e.axes.clear();
  BOOST_TEST(has(refusal(write_exchange(folder / "b.h5", e)), "sinogram order"));
}

BOOST_AUTO_TEST_CASE(written_scan_is_read_back_to_the_bit) {
  const TemporaryFolder folder;
  ProjectionSet scan = read_scan(data / "diamond-24737");
  scan.geometry.pitch_u = 0.1;
  scan.geometry.pitch_v = 1.0 / 3;
  scan.geometry.unit = "mm";
  write_data_exchange(folder / "a.h5", scan);
  const ProjectionSet back = read_scan(folder / "a.h5");
  BOOST_TEST((back.data == scan.data));
  BOOST_TEST(back.geometry.pitch_u == 0.1);
  BOOST_TEST(back.geometry.pitch_v == 1.0 / 3);
  BOOST_TEST(back.geometry.center == 85.85);
  BOOST_TEST(back.geometry.unit == "mm");
  BOOST_TEST(back.report.center_source == "file");
  for (std::size_t k = 0; k < scan.geometry.theta_rad.size(); ++k)
    BOOST_TEST(std::abs(back.geometry.theta_rad[k] - scan.geometry.theta_rad[k]) <=
               tolerance::fp64_sum(3, 2));
}

BOOST_AUTO_TEST_CASE(scan_is_written_whole_or_not_at_all) {
  const TemporaryFolder folder;
  ProjectionSet scan;
  BOOST_CHECK_THROW(write_data_exchange(folder / "a.h5", scan), InputError);
  scan.geometry.rows = scan.geometry.columns = 2;
  scan.geometry.theta_rad = {0};
  scan.data.resize(3);
  BOOST_CHECK_THROW(write_data_exchange(folder / "a.h5", scan), InputError);
  scan.data.resize(4);
  BOOST_CHECK_THROW(write_data_exchange(folder / "no/a.h5", scan), FileError);
  BOOST_TEST(std::filesystem::is_empty(folder.path()));
}

BOOST_AUTO_TEST_CASE(not_a_number_in_line_integrals_is_refused_with_its_place) {
  const TemporaryFolder folder;
  Exchange e;
  e.white = false;
  e.description = "line integrals";
  e.data.assign(K * V * U, 1);
  BOOST_TEST(read_scan(write_exchange(folder / "a.h5", e)).data.back() == 1);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    e.data[(2 * V + 1) * U + 2] = bad;
    const std::string message = refusal(write_exchange(folder / "a.h5", e));
    BOOST_TEST(has(message, "/exchange/data"));
    BOOST_TEST(has(message, "[2][1][2]"));
  }
}

BOOST_AUTO_TEST_CASE(values_that_float32_rounds_are_noted) {
  const TemporaryFolder folder;
  for (const auto& [value, rounds] : {std::pair{0.5, false}, {0.1, true}}) {
    const Path path = folder / "a.h5";
    {
      Hdf5Writer file(path);
      file.group("/exchange");
      file.dataset("/exchange/data", {K, V, U}, std::vector<double>(K * V * U, value), H5T_IEEE_F64LE);
      file.attribute("/exchange/data", "description", "line integrals");
      file.dataset("/exchange/theta", {K}, {0, 45, 90, 135}, H5T_IEEE_F64LE);
      file.attribute("/exchange/theta", "units", "degrees");
    }
    const auto notes = read_scan(path).report.notes;
    const bool noted = std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
      return note.find("rounded to float32") != std::string::npos;
    });
    BOOST_TEST(noted == rounds);
  }
}

BOOST_AUTO_TEST_CASE(counts_without_flats_are_refused) {
  const TemporaryFolder folder;
  Exchange e;
  e.white = false;
  BOOST_TEST(has(refusal(write_exchange(folder / "a.h5", e)), "data_white"));
}

BOOST_AUTO_TEST_CASE(wrong_counts_of_angles_and_shapes_are_refused) {
  const TemporaryFolder folder;
  Exchange e;
  e.theta.pop_back();
  BOOST_TEST(has(refusal(write_exchange(folder / "a.h5", e)), "3 angles for 4 frames"));
  e = {};
  e.theta[2] = std::numeric_limits<double>::quiet_NaN();
  BOOST_TEST(has(refusal(write_exchange(folder / "b.h5", e)), "angle 2"));
  e = {};
  e.shape = {K * V, U};
  BOOST_TEST(has(refusal(write_exchange(folder / "c.h5", e)), "three axes"));
  e = {};
  e.shape = {K, U, V};
  BOOST_TEST(has(refusal(write_exchange(folder / "d.h5", e)), "2 rows x 3 columns"));
  e = {};
  std::fill_n(e.data.begin() + V * U, V * U, 0.0);
  BOOST_TEST(has(refusal(write_exchange(folder / "e.h5", e)), "projection 1"));
  e = {};
  e.data.clear();
  e.shape = {K, V, std::uint64_t{1} << 50};
  BOOST_TEST(refusal(folder / "no.h5") != "accepted");
  Hdf5Writer(folder / "empty.h5").group("/exchange");
  BOOST_TEST(has(refusal(folder / "empty.h5"), "neither Data Exchange"));
}

// --- NXtomo ---

BOOST_AUTO_TEST_CASE(nxtomo_is_sorted_by_its_image_key) {
  const TemporaryFolder folder;
  const ProjectionSet scan = read_scan(write_nxtomo(folder / "a.nxs"));
  check_samples(scan);
  BOOST_TEST(scan.report.format == "nxtomo");
  BOOST_TEST(scan.geometry.views() == 4);
  BOOST_TEST(std::abs(scan.geometry.theta_rad[3] - 3 * pi / 4) <= tolerance::fp64_sum(3, 3));
  BOOST_TEST(scan.geometry.pitch_v == 0.75);
  BOOST_TEST(scan.geometry.unit == "mm");
  BOOST_TEST(scan.report.notes.front() == "1 frames marked invalid were left out");
}

BOOST_AUTO_TEST_CASE(nxtomo_with_wrong_keys_is_refused) {
  const TemporaryFolder folder;
  BOOST_TEST(has(refusal(write_nxtomo(folder / "a.nxs", {2, 1, 0})), "3 keys for 8 frames"));
  BOOST_TEST(has(refusal(write_nxtomo(folder / "b.nxs", {2, 0, 0, 0, 3, 0, 0, 0})), "no flats"));
  BOOST_TEST(has(refusal(write_nxtomo(folder / "c.nxs", {2, 1, 0, 7, 3, 0, 0, 0})), "key 7"));
}

// --- what is stated ---

BOOST_AUTO_TEST_CASE(ranges_of_views_are_half_open_and_rise) {
  BOOST_TEST((view_ranges_of("0:40,41:90") == ViewRanges{{0, 40}, {41, 90}}));
  BOOST_TEST((view_ranges_of(":3,7,9:") == ViewRanges{{0, 3}, {7, 8}, {9, last_view}}));
  BOOST_TEST((checked_ranges(view_ranges_of("7:"), 9) == ViewRanges{{7, 9}}));
  BOOST_TEST(text_of(view_ranges_of("0:40,41:")) == "0:40,41:");
  for (const char* text : {"", ":", "a", "1:2:3", "-1:3", "1.5", "1,,2", "1:2,"})
    BOOST_CHECK_THROW(view_ranges_of(text), InputError);
  for (const char* text : {"3:3", "3:2", "0:10", "0:4,3:5", "9"})
    BOOST_CHECK_THROW(checked_ranges(view_ranges_of(text), 9), InputError);
}

BOOST_AUTO_TEST_CASE(statement_is_kept_in_the_report_and_wins_over_the_file) {
  const TemporaryFolder folder;
  Exchange e;
  const Path path = write_exchange(folder / "a.h5", e);
  ScanOptions options;
  options.input.values = SampleValues::line_integrals;
  options.input.views = {{1, 3}};
  Understood understood;
  const ProjectionSet scan = read_scan(path, options, {}, &understood);
  BOOST_TEST(scan.geometry.views() == 2);
  BOOST_TEST((understood.stated == options.input));
  BOOST_TEST(scan.data[0] == static_cast<float>(e.data[V * U]));
  options.input.dark = 0;
  BOOST_TEST(has(refusal(path, options), "leave `flats` and `darks` out"));
}

BOOST_AUTO_TEST_CASE(text_is_read_in_the_encodings_that_editors_save) {
  BOOST_TEST(utf8_of("\xef\xbb\xbf"
                     "a\xc2\xb5") == "a\u00b5");
  BOOST_TEST(utf8_of("\xb5m") == "\u00b5m");
  BOOST_TEST(utf8_of(std::string("\xff\xfe"
                                 "1\0\xac\x20",
                                 6)) == "1\u20ac");
  BOOST_TEST(utf8_of(std::string("\xfe\xff\xd8\x3d\xde\x00", 6)) == "\U0001f600");
  BOOST_TEST(utf8_of("\xc0\x80") == "\u00c0\u20ac");  // no overlong forms
  BOOST_TEST(comma_hint("-0,5") == "; a decimal comma? write -0.5");
  for (const char* word : {"0.5", "1,5,2", "a,b", ",", "1.5,2"}) BOOST_TEST(comma_hint(word) == "");
}

BOOST_AUTO_TEST_CASE(units_of_length_are_known_by_many_names) {
  for (const char* unit : {"mm", "MM", "Millimeter", "millimetres", " mm "})
    BOOST_TEST(metres_exponent(unit).value_or(1) == -3, unit);
  for (const char* unit : {"um", "\u00b5m", "\u03bcm", "\xb5m", "Microns", "micrometre"})
    BOOST_TEST(metres_exponent(unit).value_or(1) == -6, unit);
  BOOST_TEST(metres_exponent("M").value_or(1) == 0);
  for (const char* unit : {"", "furlong", "pixel", "s"}) BOOST_TEST(!metres_exponent(unit), unit);
}

// --- what is no scan ---

BOOST_AUTO_TEST_CASE(files_of_other_kinds_are_refused) {
  const TemporaryFolder folder;
  BOOST_TEST(has(refusal(folder / "missing.h5"), "no such file"));
  BOOST_TEST(has(refusal(folder.file("empty.h5", "")), "empty"));
  BOOST_TEST(has(refusal(folder.file("text.h5", "hello")), "no scan"));
  BOOST_TEST(has(refusal(folder.file("other.json", "{}")), "scan.json"));
  BOOST_TEST(has(refusal(folder.path()), "scan.json"));
  BOOST_TEST(refusal(data / "aps-tooth/LICENSE.txt") != "accepted");
  BOOST_TEST(refusal(data / "diamond-24737/flat_00001.tiff") != "accepted");
}

BOOST_AUTO_TEST_CASE(truncated_hdf5_is_refused_or_whole_at_every_length) {
  const TemporaryFolder folder;
  const std::string whole = support::bytes_of(write_exchange(folder / "a.h5", {}));
  for (std::size_t length = 0; length < whole.size(); length += 13) {
    const std::string message = refusal(folder.file("cut.h5", whole.substr(0, length)));
    BOOST_REQUIRE(message != "accepted");
  }
}

// The bytes to damage: all of them; under a sanitizer, where each reading's child process takes far longer,
// the headers (HDF5's blocks begin with four capitals) and of the rest every 29th.
std::vector<std::size_t> places_to_damage(const std::string& bytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  constexpr std::size_t stride = 29, header = 40;
#else
  constexpr std::size_t stride = 1, header = 0;
#endif
  std::vector<bool> wanted(bytes.size());
  for (std::size_t at = 0; at < bytes.size(); at += stride) wanted[at] = true;
  std::vector<std::size_t> starts{0};
  for (const char* block :
       {"OHDR", "OCHK", "FRHP", "FHDB", "FHIB", "BTHD", "BTLF", "BTIN", "FAHD", "FADB", "EAHD"})
    for (std::size_t at = bytes.find(block); at != std::string::npos; at = bytes.find(block, at + 1))
      starts.push_back(at);
  for (const std::size_t start : starts)
    for (std::size_t at = start; at < std::min(start + header, bytes.size()); ++at) wanted[at] = true;
  std::vector<std::size_t> places;
  for (std::size_t at = 0; at < bytes.size(); ++at)
    if (wanted[at]) places.push_back(at);
  return places;
}

// Only files of our own: their data and metadata carry checksums. HDF5 1.10 itself reads beyond its buffers
// when an old layout, which has none, is damaged.
BOOST_AUTO_TEST_CASE(scan_of_ours_with_a_damaged_byte_is_refused_or_unchanged) {
  const TemporaryFolder folder;
  const ProjectionSet scan = read_scan(write_exchange(folder / "a.h5", {}));
  write_data_exchange(folder / "b.h5", scan);
  const ProjectionSet whole = read_scan(folder / "b.h5");
  const std::string bytes = support::bytes_of(folder / "b.h5");
  const std::vector<std::size_t> places = places_to_damage(bytes);
  BOOST_TEST_MESSAGE(places.size() << " of " << bytes.size() << " bytes damaged");
  for (const std::size_t at : places) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    try {
      const ProjectionSet back = read_scan(folder.file("cut.h5", damaged));
      BOOST_REQUIRE_MESSAGE(back.data == whole.data, "byte " << at);
      BOOST_REQUIRE_MESSAGE(back.geometry.theta_rad == whole.geometry.theta_rad, "byte " << at);
      BOOST_REQUIRE_MESSAGE(back.geometry.center == whole.geometry.center, "byte " << at);
    } catch (const FileError&) {
    }
  }
}

BOOST_AUTO_TEST_CASE(memory_limit_is_honoured_before_reading) {
  ScanOptions options;
  options.max_memory_bytes = 1 << 18;  // less than a view of 160 x 135 in double, twice
  BOOST_CHECK_THROW(static_cast<void>(read_scan(data / "diamond-24737", options)), ResourceError);
}

BOOST_AUTO_TEST_CASE(scan_beyond_memory_is_read_into_scratch_and_is_the_same) {
  const ProjectionSet in_memory = read_scan(data / "diamond-24737");
  ScanOptions options;
  options.max_memory_bytes = 16 << 20;  // an eighth is less than the scan's 7.4 MiB
  options.scratch = ".";                // a disk, which a temporary folder need not be
  const ProjectionSet in_scratch = read_scan(data / "diamond-24737", options);
  BOOST_TEST(static_cast<bool>(in_scratch.data.scratch()));
  BOOST_TEST((in_scratch.data == in_memory.data));
  BOOST_TEST(in_scratch.report.sha256 == in_memory.report.sha256);
  BOOST_TEST(in_scratch.report.dead_pixels == in_memory.report.dead_pixels);
}
