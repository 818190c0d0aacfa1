// Scans as files, written with the plain HDF5 and TIFF libraries, independent of host/files/io: Data
// Exchange, NXtomo, TIFF, a folder with scan.json. Used by the tests of the scan readers.
#pragma once

#include <hdf5.h>
#include <tiffio.h>

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/files/io/tiff.hpp"
#include "tests/support/places.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr::support {

using Path = std::filesystem::path;
using Shape = std::vector<hsize_t>;

inline const Path data = Path(source_dir) / "data";
inline constexpr double pi = std::numbers::pi;

// The message of the InputError or FileError that reading must end with; any other exception fails the test.
inline std::string refusal(const Path& path, const ScanOptions& options = {}) {
  try {
    static_cast<void>(read_scan(path, options));
  } catch (const Error& e) {
    BOOST_TEST((e.kind() == ErrorKind::input || e.kind() == ErrorKind::file), e.what());
    return e.what();
  }
  return "accepted";
}

inline bool has(const std::string& text, const std::string& part) {
  const bool found = text.find(part) != std::string::npos;
  if (!found) BOOST_TEST_MESSAGE("'" << part << "' is not in: " << text);
  return found;
}

// --- an HDF5 file written with the plain C API, independent of host/files/io ---

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
inline constexpr int K = 4, V = 2, U = 3;
inline double transmission(int k, int v, int u) { return 1.0 / (1 + k + 2 * v + 3 * u); }
inline double raw_count(int k, int v, int u) { return 100 + 10000 * transmission(k, v, u); }
inline float expected(int k, int v, int u) {
  return static_cast<float>(-std::log((raw_count(k, v, u) - 100) / 10000));
}

inline std::vector<double> raw_counts(bool sinograms = false) {
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

inline void check_samples(const ProjectionSet& scan) {
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

inline Path write_exchange(const Path& path, const Exchange& e) {
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

// --- TIFF made by libtiff itself ---

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

struct TiffImage {
  std::int64_t rows = 0, columns = 0;
  std::vector<double> samples;  // [row][column]
};

// Of a file of one image.
inline TiffImage read_tiff(const Path& path) {
  io::TiffFile file(path);
  BOOST_REQUIRE(file.stack().images == 1);
  TiffImage image{file.stack().rows, file.stack().columns, {}};
  image.samples.resize(static_cast<std::size_t>(image.rows * image.columns));
  file.read(0, image.samples.data());
  return image;
}

template <typename T>
void check_tiff(const Path& path, int format, bool tiled, int compression) {
  std::vector<T> samples(19 * 37);
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<T>(static_cast<double>(i) * 0.37 - 5);
  samples[3] = std::numeric_limits<T>::max();
  samples[4] = std::numeric_limits<T>::lowest();
  write_tiff(path, 19, 37, samples, format, tiled, compression);
  const TiffImage image = read_tiff(path);
  BOOST_TEST(image.rows == 19);
  BOOST_TEST(image.columns == 37);
  BOOST_REQUIRE(image.samples.size() == samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    BOOST_REQUIRE(image.samples[i] == static_cast<double>(samples[i]));
}

// The scan of raw_counts() as a folder; projections named so that text order is not their order.
inline nlohmann::json write_folder(const TemporaryFolder& folder) {
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

// --- stacks and geometry of cone beam ---

/// An .npy file of the given type; values in the order of the file.
template <typename T>
std::string npy_bytes(const std::vector<T>& values, const std::string& shape, bool fortran = false) {
  std::string header = std::string("{'descr': '<f") + (sizeof(T) == 8 ? "8" : "4") +
                       "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" + shape +
                       "), }";
  header.append(63 - (10 + header.size()) % 64, ' ').push_back('\n');
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes.push_back(static_cast<char>(header.size() & 0xff));
  bytes.push_back(static_cast<char>(header.size() >> 8));
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  return bytes;
}

/// A MetaImage stack; float samples[view][row][column].
inline std::string stack_bytes(int columns, int rows, int views, const std::string& place,
                               const std::vector<float>& samples) {
  std::string bytes = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n" +
                      place + "DimSize = " + std::to_string(columns) + " " + std::to_string(rows) + " " +
                      std::to_string(views) + "\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
  bytes.append(reinterpret_cast<const char*>(samples.data()), samples.size() * sizeof(float));
  return bytes;
}

/// One of zeros but for its first sample, 1.
inline std::string stack_bytes(int columns, int rows, int views, const std::string& place) {
  std::vector<float> samples(static_cast<std::size_t>(columns * rows * views));
  samples.at(0) = 1;
  return stack_bytes(columns, rows, views, place, samples);
}

inline std::string folder_refusal(const TemporaryFolder& folder, const nlohmann::json& description) {
  static_cast<void>(folder.file("scan.json", description.dump()));
  return refusal(folder.path());
}

inline const std::string nxtomo_entry = "/entry1/tomo_entry";

/// `more` writes what it likes into the file, which has the groups instrument/ccd, instrument/source and
/// sample.
inline Path write_nxtomo(const Path& path, std::vector<double> keys = {2, 1, 0, 0, 3, 0, 1, 0},
                         const std::function<void(Hdf5Writer&)>& more = {}) {
  Hdf5Writer file(path);
  for (const char* group :
       {"/entry1", "/entry1/tomo_entry", "/entry1/tomo_entry/instrument", "/entry1/tomo_entry/instrument/ccd",
        "/entry1/tomo_entry/instrument/source", "/entry1/tomo_entry/sample"})
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
  if (more) more(file);
  return path;
}

}  // namespace vdvr::support
