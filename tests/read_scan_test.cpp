#define BOOST_TEST_MODULE read_scan
#include "vdvr/read_scan.hpp"

#include <hdf5.h>
#include <tiffio.h>

#include <boost/test/data/test_case.hpp>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/io/scan_readers.hpp"
#include "host/io/tiff.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/hash.hpp"

using namespace vdvr;
using support::TemporaryFolder;
using Path = std::filesystem::path;
using Shape = std::vector<hsize_t>;

// Under AddressSanitizer: a size that a damaged file claims makes malloc fail, as it does without the
// sanitizer.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

namespace {

const Path data = Path(VDVR_SOURCE_DIR) / "data";
constexpr double pi = std::numbers::pi;

// The message of the InputError or FileError that reading must end with; any other exception fails the test.
std::string refusal(const Path& path, const ScanOptions& options = {}) {
  try {
    static_cast<void>(read_scan(path, options));
  } catch (const Error& e) {
    BOOST_TEST(e.exit_code() == 2, e.what());
    return e.what();
  }
  return "accepted";
}

bool has(const std::string& text, const std::string& part) {
  const bool found = text.find(part) != std::string::npos;
  if (!found) BOOST_TEST_MESSAGE("'" << part << "' is not in: " << text);
  return found;
}

// --- an HDF5 file written with the plain C API, independent of host/io
// ---------------------------------------------------

class Hdf5Writer {
 public:
  explicit Hdf5Writer(const Path& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {}
  ~Hdf5Writer() { H5Fclose(file_); }
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;
  [[nodiscard]] hid_t id() const { return file_; }

  void group(const std::string& name) {
    H5Gclose(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }
  void dataset(const std::string& name, const Shape& shape, const std::vector<double>& values,
               hid_t type = H5T_IEEE_F32LE) {
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t set = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (!values.empty()) H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(set);
    H5Sclose(space);
  }
  void attribute(const std::string& object, const std::string& name, const std::string& text) {
    const hid_t handle = H5Oopen(file_, object.c_str(), H5P_DEFAULT), space = H5Screate(H5S_SCALAR),
                type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    const hid_t attribute = H5Acreate2(handle, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT);
    const char* pointer = text.c_str();
    H5Awrite(attribute, type, &pointer);
    H5Aclose(attribute);
    H5Tclose(type);
    H5Sclose(space);
    H5Oclose(handle);
  }

 private:
  hid_t file_;
};

// 4 views, 2 rows, 3 columns; each sample tells its place.
constexpr int K = 4, V = 2, U = 3;
double transmission(int k, int v, int u) { return 1.0 / (1 + k + 2 * v + 3 * u); }
double raw_count(int k, int v, int u) { return 100 + 10000 * transmission(k, v, u); }
float expected(int k, int v, int u) {
  return static_cast<float>(-std::log((raw_count(k, v, u) - 100) / 10000));
}

std::vector<double> raw_counts(bool sinograms = false) {
  std::vector<double> out;
  if (sinograms) {
    for (int v = 0; v < V; ++v)
      for (int k = 0; k < K; ++k)
        for (int u = 0; u < U; ++u) out.push_back(raw_count(k, v, u));
  } else {
    for (int k = 0; k < K; ++k)
      for (int v = 0; v < V; ++v)
        for (int u = 0; u < U; ++u) out.push_back(raw_count(k, v, u));
  }
  return out;
}

void check_samples(const ProjectionSet& scan) {
  BOOST_REQUIRE(scan.data.size() == K * V * U);
  std::size_t i = 0;
  for (int k = 0; k < K; ++k)
    for (int v = 0; v < V; ++v)
      // Rounded once to float from a double whose own error is far below half an ulp of it: at most one ulp
      // apart.
      for (int u = 0; u < U; ++u, ++i)
        BOOST_TEST(std::abs(scan.data[i] - expected(k, v, u)) <=
                   tolerance::fp32_sum(2, std::abs(expected(k, v, u))));
}

struct Exchange {
  Shape shape{K, V, U};
  std::vector<double> data = raw_counts(), theta{0, 45, 90, 135};
  bool white = true, theta_units = true;
  std::string axes, description;
};

Path write_exchange(const Path& path, const Exchange& e) {
  Hdf5Writer file(path);
  file.group("/exchange");
  file.dataset("/exchange/data", e.shape, e.data);
  if (!e.axes.empty()) file.attribute("/exchange/data", "axes", e.axes);
  if (!e.description.empty()) file.attribute("/exchange/data", "description", e.description);
  file.dataset("/exchange/theta", {e.theta.size()}, e.theta, H5T_IEEE_F64LE);
  if (e.white) {
    // Two flats whose mean is 10100, one dark of 100.
    std::vector<double> white(2 * V * U, 10050);
    std::fill(white.begin() + V * U, white.end(), 10150);
    file.dataset("/exchange/data_white", {2, V, U}, white);
    file.attribute("/exchange/data_white", "axes", "theta_white:y:x");
    file.dataset("/exchange/data_dark", {1, V, U}, std::vector<double>(V * U, 100));
    file.attribute("/exchange/data_dark", "axes", "theta_dark:y:x");
  }
  return path;
}

// --- TIFF made by libtiff itself
// -----------------------------------------------------------------------------------------

template <typename T>
void write_tiff(const Path& path, int rows, int columns, const std::vector<T>& samples, int format,
                bool tiled = false, int compression = COMPRESSION_NONE, int channels = 1) {
  TIFF* t = TIFFOpen(path.c_str(), "w");
  TIFFSetField(t, TIFFTAG_IMAGEWIDTH, columns);
  TIFFSetField(t, TIFFTAG_IMAGELENGTH, rows);
  TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * sizeof(T)));
  TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, channels);
  TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, format);
  TIFFSetField(t, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(t, TIFFTAG_PHOTOMETRIC, channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(t, TIFFTAG_COMPRESSION, compression);
  if (tiled) {
    TIFFSetField(t, TIFFTAG_TILEWIDTH, 16);
    TIFFSetField(t, TIFFTAG_TILELENGTH, 16);
    std::vector<T> tile(16 * 16);
    for (int y = 0; y < rows; y += 16)
      for (int x = 0; x < columns; x += 16) {
        for (int r = 0; r < 16; ++r)
          for (int c = 0; c < 16; ++c)
            tile[static_cast<std::size_t>(16 * r + c)] =
                y + r < rows && x + c < columns ? samples[static_cast<std::size_t>((y + r) * columns + x + c)]
                                                : T{};
        TIFFWriteTile(t, tile.data(), static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 0, 0);
      }
  } else {
    TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, 2);
    std::vector<T> row(static_cast<std::size_t>(columns * channels));
    for (int y = 0; y < rows; ++y) {
      std::copy_n(samples.begin() + y * columns * channels, row.size(), row.begin());
      TIFFWriteScanline(t, row.data(), static_cast<std::uint32_t>(y), 0);
    }
  }
  TIFFClose(t);
}

template <typename T>
void check_tiff(const Path& path, int format, bool tiled, int compression) {
  std::vector<T> samples(19 * 37);
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<T>(static_cast<double>(i) * 0.37 - 5);
  samples[3] = std::numeric_limits<T>::max();
  samples[4] = std::numeric_limits<T>::lowest();
  write_tiff(path, 19, 37, samples, format, tiled, compression);
  const io::TiffImage image = io::read_tiff(path);
  BOOST_TEST(image.rows == 19);
  BOOST_TEST(image.columns == 37);
  BOOST_REQUIRE(image.samples.size() == samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    BOOST_REQUIRE(image.samples[i] == static_cast<double>(samples[i]));
}

// The scan of raw_counts() as a folder; projections named so that text order is not their order.
nlohmann::json write_folder(const TemporaryFolder& folder) {
  std::filesystem::create_directories(folder / "p");
  for (int k = 0; k < K; ++k) {
    std::vector<float> frame;
    for (int v = 0; v < V; ++v)
      for (int u = 0; u < U; ++u) frame.push_back(static_cast<float>(raw_count(k, v, u)));
    write_tiff(folder / ("p/view_" + std::to_string(8 + k) + ".tif"), V, U, frame, SAMPLEFORMAT_IEEEFP);
  }
  write_tiff(folder / "flat.tif", V, U, std::vector<float>(V * U, 10100), SAMPLEFORMAT_IEEEFP);
  write_tiff(folder / "dark.tif", V, U, std::vector<float>(V * U, 100), SAMPLEFORMAT_IEEEFP);
  static_cast<void>(folder.file("angles.txt", "# degrees\n-1\n0 45\n90, 135\n-1\n"));
  return {{"projections", "p/view_*.tif"},
          {"flats", {"flat.tif"}},
          {"darks", {"dark.tif"}},
          {"angles", "angles.txt"},
          {"angle_range", {1, 5}}};
}

std::string folder_refusal(const TemporaryFolder& folder, const nlohmann::json& description) {
  static_cast<void>(folder.file("scan.json", description.dump()));
  return refusal(folder.path());
}

Path write_nxtomo(const Path& path, std::vector<double> keys = {2, 1, 0, 0, 3, 0, 1, 0}) {
  Hdf5Writer file(path);
  for (const char* group : {"/entry1", "/entry1/tomo_entry", "/entry1/tomo_entry/instrument",
                            "/entry1/tomo_entry/instrument/ccd", "/entry1/tomo_entry/sample"})
    file.group(group);
  file.attribute("/entry1/tomo_entry/instrument/ccd", "NX_class", "NXdetector");
  const std::string detector = "/entry1/tomo_entry/instrument/ccd/";
  std::vector<double> frames;
  int k = 0;
  for (const double key : {2, 1, 0, 0, 3, 0, 1, 0}) {
    if (key == 0) {
      for (int v = 0; v < V; ++v)
        for (int u = 0; u < U; ++u) frames.push_back(raw_count(k, v, u));
      ++k;
    } else {
      frames.insert(frames.end(), V * U, key == 1 ? 10100 : key == 2 ? 100 : -1);
    }
  }
  file.dataset(detector + "data", {8, V, U}, frames);
  file.dataset(detector + "image_key", {keys.size()}, keys, H5T_STD_I32LE);
  file.dataset(detector + "x_pixel_size", {1}, {0.5}, H5T_IEEE_F64LE);
  file.dataset(detector + "y_pixel_size", {1}, {0.75}, H5T_IEEE_F64LE);
  file.attribute(detector + "x_pixel_size", "units", "mm");
  file.attribute(detector + "y_pixel_size", "units", "mm");
  file.dataset("/entry1/tomo_entry/sample/rotation_angle", {8}, {0, 0, 0, pi / 4, 9, pi / 2, 9, 3 * pi / 4},
               H5T_IEEE_F64LE);
  file.attribute("/entry1/tomo_entry/sample/rotation_angle", "units", "rad");
  return path;
}

}  // namespace

// --- the two real scans
// -------------------------------------------------------------------------------------------------

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
    BOOST_TEST(a.data == other->data);
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

// --- Data Exchange
// ------------------------------------------------------------------------------------------------------

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
  BOOST_TEST(back.data == scan.data);
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

BOOST_AUTO_TEST_CASE(links_out_of_the_file_are_refused) {
  const TemporaryFolder folder;
  write_exchange(folder / "a.h5", {});
  {
    Hdf5Writer file(folder / "b.h5");
    H5Lcreate_external((folder / "a.h5").c_str(), "/exchange", file.id(), "/exchange", H5P_DEFAULT,
                       H5P_DEFAULT);
  }
  BOOST_TEST(refusal(folder / "b.h5") != "accepted");
}

// --- NXtomo
// -------------------------------------------------------------------------------------------------------------

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

// --- TIFF and folders
// -----------------------------------------------------------------------------------------------------

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
      BOOST_REQUIRE_THROW(static_cast<void>(io::read_tiff(cut)), FileError);
    }
  }
}

BOOST_AUTO_TEST_CASE(tiff_that_is_no_single_grey_image_is_refused) {
  const TemporaryFolder folder;
  write_tiff(folder / "rgb.tif", 2, 2, std::vector<std::uint8_t>(12), SAMPLEFORMAT_UINT, false,
             COMPRESSION_NONE, 3);
  BOOST_CHECK_THROW(static_cast<void>(io::read_tiff(folder / "rgb.tif")), FileError);
  BOOST_CHECK_THROW(static_cast<void>(io::read_tiff(folder.file("text.tif", "not a picture"))), FileError);
  BOOST_CHECK_THROW(static_cast<void>(io::read_tiff(folder.path())), FileError);
  BOOST_CHECK_THROW(static_cast<void>(io::read_tiff(folder / "missing.tif")), FileError);
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
  BOOST_TEST(part.geometry.theta_rad ==
             std::vector<double>(scan.geometry.theta_rad.begin() + 1, scan.geometry.theta_rad.begin() + 3));
  BOOST_TEST(part.data == std::vector<float>(scan.data.begin() + V * U, scan.data.begin() + 3 * V * U));
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
      {{{"flats", 3}}, "flats"},
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
      {{{"description", "counts"}}, "description"}};
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

// --- stacks
// ---------------------------------------------------------------------------------------------------------------

BOOST_AUTO_TEST_CASE(stack_is_read_with_its_angles_file) {
  const TemporaryFolder folder;
  const std::string header =
      "NDims = 3\nBinaryDataByteOrderMSB = False\nElementSpacing = 0.5 2 1\nDimSize = 3 1 2\nElementType = "
      "MET_UCHAR\nElementDataFile = LOCAL\n";
  const Path stack = folder.file("a.mha", header + "abcdef");
  ScanOptions options;
  BOOST_TEST(has(refusal(stack), "--angles-file"));
  options.angles_file = folder.file("angles.txt", "0\n90\n");
  const ProjectionSet scan = read_scan(stack, options);
  BOOST_TEST(scan.geometry.rows == 1);
  BOOST_TEST(scan.geometry.columns == 3);
  BOOST_TEST(scan.geometry.pitch_v == 2);
  BOOST_TEST(scan.data == (std::vector<float>{'a', 'b', 'c', 'd', 'e', 'f'}));
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

// --- what is no scan
// ------------------------------------------------------------------------------------------------------

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

// Only files of our own: their data and metadata carry checksums. HDF5 1.10 itself reads beyond its buffers
// when an old layout, which has none, is damaged.
BOOST_AUTO_TEST_CASE(scan_of_ours_with_a_damaged_byte_is_refused_or_unchanged) {
  const TemporaryFolder folder;
  const ProjectionSet scan = read_scan(write_exchange(folder / "a.h5", {}));
  write_data_exchange(folder / "b.h5", scan);
  const ProjectionSet whole = read_scan(folder / "b.h5");
  const std::string bytes = support::bytes_of(folder / "b.h5");
  for (std::size_t at = 0; at < bytes.size(); ++at) {
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
  options.max_memory_bytes = 1 << 20;
  BOOST_CHECK_THROW(static_cast<void>(read_scan(data / "diamond-24737", options)), ResourceError);
}
