#define BOOST_TEST_MODULE volume_file
#include "host/files/io/tiff.hpp"
#include "vdvr/expert/volume_file.hpp"

#include <hdf5.h>
#include <fmt/format.h>
#include <tiffio.h>
#include <zlib.h>

#include <boost/test/data/test_case.hpp>
#include <boost/test/unit_test.hpp>
#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>

#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using support::TemporaryFolder;

namespace {

Volume ramp() {
  Volume volume;
  volume.grid.cells = {2, 1, 3};
  volume.grid.origin = {-1.25, 0.1, 7};
  volume.grid.spacing = {0.5, 1.0 / 3, 2};
  volume.grid.unit = "pixel";
  for (int i = 0; i < 3 * 2 * 4; ++i) volume.samples.push_back(0.1f * static_cast<float>(i) - 1);
  return volume;
}

const std::string mha_start = "ObjectType = Image\nNDims = 3\nBinaryData = True\n";
const std::string nrrd_start = "NRRD0004\ndimension: 3\nsizes: 2 2 2\n";

std::string message_of(const std::filesystem::path& path) {
  try {
    static_cast<void>(read_volume(path));
  } catch (const FileError& e) {
    BOOST_TEST((e.kind() == ErrorKind::input || e.kind() == ErrorKind::file));
    return e.what();
  }
  return "accepted";
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
           bytes.size());
  out.resize(size);
  return out;
}

// --- every scalar type, in both byte orders: eight samples 0, 1, 2 ... 7, the last negative where it can be

template <class T>
std::string samples_as(bool big_endian) {
  std::string bytes;
  for (int i = 0; i < 8; ++i) {
    const T value = i == 7 && std::is_signed_v<T> ? static_cast<T>(-7) : static_cast<T>(i);
    std::string one(sizeof(T), '\0');
    std::memcpy(one.data(), &value, sizeof(T));
    if (big_endian) std::reverse(one.begin(), one.end());
    bytes += one;
  }
  return bytes;
}

struct ScalarType {
  const char *met, *nrrd;
  bool is_signed;
  std::string (*samples)(bool);
};
const std::vector<ScalarType> scalar_types{{"MET_UCHAR", "uint8", false, samples_as<std::uint8_t>},
                                           {"MET_CHAR", "int8", true, samples_as<std::int8_t>},
                                           {"MET_USHORT", "ushort", false, samples_as<std::uint16_t>},
                                           {"MET_SHORT", "int16", true, samples_as<std::int16_t>},
                                           {"MET_UINT", "unsigned int", false, samples_as<std::uint32_t>},
                                           {"MET_INT", "int", true, samples_as<std::int32_t>},
                                           {"MET_FLOAT", "float", true, samples_as<float>},
                                           {"MET_DOUBLE", "double", true, samples_as<double>}};

void check_counted(const Volume& volume, bool is_signed) {
  BOOST_REQUIRE(volume.samples.size() == 8);
  for (std::size_t i = 0; i < 7; ++i) BOOST_TEST(volume.samples[i] == static_cast<float>(i));
  BOOST_TEST(volume.samples[7] == (is_signed ? -7 : 7));
}

// --- HDF5

/// A dataset with attributes of three numbers; `type` of the file.
void write_hdf5(const std::filesystem::path& path, hid_t type, const std::vector<hsize_t>& shape,
                const std::vector<std::pair<std::string, std::vector<double>>>& attributes = {}) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  const hid_t data = H5Dcreate2(file, "volume", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  std::vector<double> values;
  for (hsize_t i = 0; i < static_cast<hsize_t>(H5Sget_simple_extent_npoints(space)); ++i)
    values.push_back(static_cast<double>(i));
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  for (const auto& [name, numbers] : attributes) {
    const hsize_t n = numbers.size();
    const hid_t row = H5Screate_simple(1, &n, nullptr);
    const hid_t attribute = H5Acreate2(data, name.c_str(), H5T_IEEE_F64LE, row, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, H5T_NATIVE_DOUBLE, numbers.data());
    H5Aclose(attribute);
    H5Sclose(row);
  }
  H5Dclose(data);
  H5Sclose(space);
  H5Fclose(file);
}

// --- TIFF

/// Images of 3 x 2 pixels of uint16 one after another, counting on.
void write_tiff(const std::filesystem::path& path, int first, int images, const char* mode = "w",
                const std::string& description = "", std::uint32_t columns = 3) {
  TIFF* tiff = TIFFOpen(path.c_str(), mode);
  for (int i = 0; i < images; ++i) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, columns);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 2);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 2);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    if (!description.empty()) {
      TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
      TIFFSetField(tiff, TIFFTAG_XRESOLUTION, 4.0);
      TIFFSetField(tiff, TIFFTAG_YRESOLUTION, 2.0);
    }
    std::vector<std::uint16_t> pixels;
    for (std::uint32_t p = 0; p < 2 * columns; ++p)
      pixels.push_back(static_cast<std::uint16_t>(first + i * 6 + static_cast<int>(p)));
    TIFFWriteEncodedStrip(tiff, 0, pixels.data(), static_cast<tmsize_t>(pixels.size() * 2));
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
}

void check_counting(const Volume& volume) {
  for (std::size_t i = 0; i < volume.samples.size(); ++i)
    BOOST_TEST(volume.samples[i] == static_cast<float>(i));
}

}  // namespace

BOOST_DATA_TEST_CASE(written_volume_is_read_back_to_the_bit,
                     boost::unit_test::data::make({"v.mha", "v.nrrd"}), name) {
  const TemporaryFolder folder;
  Volume volume = ramp();
  for (const char* unit : {"pixel", "mm"}) {
    volume.grid.unit = unit;
    write_volume(folder / name, volume);
    const Volume back = read_volume(folder / name);
    BOOST_TEST(back.grid.cells == volume.grid.cells);
    BOOST_TEST(back.grid.origin == volume.grid.origin);
    BOOST_TEST(back.grid.spacing == volume.grid.spacing);
    BOOST_TEST(back.grid.unit == volume.grid.unit);
    BOOST_TEST(back.samples == volume.samples);
  }
}

BOOST_DATA_TEST_CASE(volume_in_parts_is_the_same_file_and_is_whole_or_not_there,
                     boost::unit_test::data::make({"v.mha", "v.nrrd"}), name) {
  const TemporaryFolder folder;
  const Volume volume = ramp();
  write_volume(folder / name, volume);
  const std::string parts = std::string("parts-") + name;
  {
    VolumeWriter file(folder / parts, volume.grid);
    const std::span<const float> all = volume.samples;
    file.append(all.first(7));
    BOOST_CHECK_THROW(file.commit(), InputError);
    file.append(all.subspan(7));
    BOOST_TEST(!std::filesystem::exists(folder / parts));
    file.commit();
  }
  BOOST_TEST(support::bytes_of(folder / parts) == support::bytes_of(folder / name));
}

BOOST_AUTO_TEST_CASE(big_endian_shorts_in_a_detached_file_are_read) {
  const TemporaryFolder folder;
  std::string raw;
  for (int i = 0; i < 8; ++i) raw += std::string{static_cast<char>(0xff), static_cast<char>(i)};
  static_cast<void>(folder.file("v.raw", "skipped" + raw));
  const auto path =
      folder.file("v.mhd", mha_start +
                               "BinaryDataByteOrderMSB = True\nDimSize = 2 2 2\nHeaderSize = 7\n"
                               "ElementSpacing = 1 2 3\nElementType = MET_SHORT\nElementDataFile = v.raw\n");
  const Volume volume = read_volume(path);
  BOOST_TEST(volume.samples.front() == -256);
  BOOST_TEST(volume.samples.back() == -249);
  BOOST_TEST(volume.grid.unit == "mm");
  BOOST_TEST(volume.grid.spacing[2] == 3);
}

BOOST_AUTO_TEST_CASE(compressed_samples_are_read_and_truncated_ones_refused) {
  const TemporaryFolder folder;
  const std::string packed = deflated("abcdefgh");
  const std::string mha =
      mha_start +
      "CompressedData = True\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
  BOOST_TEST(read_volume(folder.file("v.mha", mha + packed)).samples[7] == 'h');
  const std::string nrrd = nrrd_start + "type: uint8\nencoding: gzip\n\n";
  BOOST_TEST(read_volume(folder.file("v.nrrd", nrrd + packed)).samples[0] == 'a');
  BOOST_TEST(
      message_of(folder.file("cut.nrrd", nrrd + packed.substr(0, packed.size() / 2))).find("truncated") !=
      std::string::npos);
  BOOST_TEST(message_of(folder.file("bad.nrrd", nrrd + "not zlib data")).find("damaged") !=
             std::string::npos);
}

BOOST_AUTO_TEST_CASE(truncated_volume_is_refused_at_every_length) {
  const TemporaryFolder folder;
  for (const char* name : {"v.mha", "v.nrrd"}) {
    write_volume(folder / name, ramp());
    const std::string whole = support::bytes_of(folder / name);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const auto cut = folder.file(std::string("cut-") + name, whole.substr(0, length));
      BOOST_REQUIRE_THROW(static_cast<void>(read_volume(cut)), FileError);
    }
  }
}

BOOST_AUTO_TEST_CASE(axes_in_any_order_and_direction_leave_samples_where_they_are) {
  const TemporaryFolder folder;
  // In the file 3 x 2 x 4 samples; axis 0 runs along y backwards, axis 1 along z, axis 2 along x.
  std::string bytes;
  for (char i = 0; i < 24; ++i) bytes += i;
  const std::string mha = mha_start +
                          "DimSize = 3 2 4\nElementSpacing = 2 5 7\nOffset = 100 200 300\n"
                          "TransformMatrix = 0 -1 0 0 0 1 1 0 0\nElementType = MET_UCHAR\n"
                          "ElementDataFile = LOCAL\n" +
                          bytes;
  const std::string nrrd =
      "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 2 4\nencoding: raw\nspace dimension: 3\n"
      "space directions: (0,-2,0) (0,0,5) (7,0,0)\nspace origin: (100,200,300)\n\n" +
      bytes;
  for (const auto& path : {folder.file("v.mha", mha), folder.file("v.nrrd", nrrd)}) {
    const Volume v = read_volume(path);
    BOOST_TEST((v.grid.cells == Index3{3, 2, 1}));
    BOOST_TEST((v.grid.spacing == Vec3{7, 2, 5}));
    BOOST_TEST((v.grid.origin == Vec3{100, 196, 300}));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 2; ++j)
        for (int k = 0; k < 4; ++k)
          BOOST_TEST(v.samples[static_cast<std::size_t>((j * 3 + (2 - i)) * 4 + k)] ==
                     static_cast<float>((k * 2 + j) * 3 + i));
  }
}

BOOST_AUTO_TEST_CASE(directions_are_straight_where_no_sample_is_off_by_a_thousandth_of_the_spacing) {
  const TemporaryFolder folder;
  const auto with = [&](const std::string& first) {
    return message_of(folder.file("v.nrrd", nrrd_start + "type: uint8\nencoding: raw\nspace dimension: 3\n" +
                                                "space directions: " + first +
                                                " (0,2,0) (0,0,1)\n\nabcdefgh"));
  };
  BOOST_TEST(with("(1,1.9e-3,0)") == "accepted");  // of a spacing of 2
  BOOST_TEST(with("(1,0,-1e-12)") == "accepted");
  BOOST_TEST(with("(1,2.1e-3,0)").find("oblique") != std::string::npos);
  BOOST_TEST(with("(1,0,-1.1e-3)").find("oblique") != std::string::npos);
  BOOST_TEST(with("(0,1,0)").find("oblique") != std::string::npos);
  BOOST_TEST(with("(0,0,0)").find("no direction") != std::string::npos);
  BOOST_TEST(with("(nan,0,0)").find("not a number") != std::string::npos);
  const std::string rest = "DimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh";
  const auto matrix = [&](const std::string& m) {
    return message_of(folder.file("v.mha", mha_start + "TransformMatrix = " + m + "\n" + rest));
  };
  BOOST_TEST(matrix("1 0 0 0 0.999999999999 0 0 6.1e-17 1") == "accepted");
  BOOST_TEST(matrix("1 0 0 0 0.99 0 0 0 1").find("TransformMatrix") != std::string::npos);
  BOOST_TEST(
      message_of(folder.file("b.mha", mha_start + "ElementSpacing = 1 0 1\n" + rest)).find("spacing") !=
      std::string::npos);
}

BOOST_AUTO_TEST_CASE(what_nrrd_does_not_know_is_a_pixel_and_lines_are_skipped) {
  const TemporaryFolder folder;
  const std::string start = nrrd_start + "type: uint8\nencoding: raw\n";
  const Volume v = read_volume(folder.file("v.nrrd", start + "spacings: nan 3 NaN\n\nabcdefgh"));
  BOOST_TEST((v.grid.spacing == Vec3{1, 3, 1}));
  BOOST_TEST(read_volume(folder.file("w.nrrd", start + "line skip: 2\n\none\ntwo\nabcdefgh")).samples[0] ==
             'a');
  BOOST_TEST(read_volume(folder.file("x.nrrd", start + "line skip: 1\nbyte skip: 2\n\none\n..abcdefgh"))
                 .samples[0] == 'a');
  BOOST_TEST(
      message_of(folder.file("y.nrrd", start + "line skip: 3\n\none\ntwo\nabcdefgh")).find("line skip") !=
      std::string::npos);
  BOOST_TEST(message_of(folder.file("z.nrrd", start + "line skip: -1\n\nabcdefgh")).find("line skip") !=
             std::string::npos);
}

BOOST_AUTO_TEST_CASE(one_sample_axis_is_refused_with_the_reason) {
  const TemporaryFolder folder;
  const auto path = folder.file(
      "v.mha", mha_start + "DimSize = 2 1 4\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh");
  BOOST_TEST(message_of(path).find("at least two") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(samples_that_are_not_finite_floats_are_refused) {
  const TemporaryFolder folder;
  Volume volume = ramp();
  volume.samples[5] = std::numeric_limits<float>::quiet_NaN();
  write_volume(folder / "v.mha", volume);
  volume.samples[7] = std::numeric_limits<float>::infinity();
  write_volume(folder / "v.mha", volume);
  const std::string message = message_of(folder / "v.mha"), all = std::to_string(volume.samples.size());
  BOOST_TEST(message.find("2 of " + all + " samples") != std::string::npos, message);
  const Index3 n = volume.grid.samples();
  BOOST_TEST(message.find(fmt::format("column {}, row {}, slice {}", 5 % n[0], 5 / n[0] % n[1],
                                      5 / n[0] / n[1])) != std::string::npos,
             message);
  BOOST_TEST(message.find("`nan_as`") != std::string::npos);
  const Volume back = read_volume(folder / "v.mha", 0, -2.0);
  volume.samples[5] = volume.samples[7] = -2;
  BOOST_TEST(back.samples == volume.samples);
  BOOST_CHECK_THROW(static_cast<void>(read_volume(folder / "v.mha", 0, std::nan(""))), InputError);
}

BOOST_AUTO_TEST_CASE(hostile_headers_are_refused) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& name, const std::string& bytes) {
    BOOST_TEST(message_of(folder.file(name, bytes)) != "accepted");
  };
  refused("a.mha", "");
  refused("a.mha", "\x89PNG\r\n");
  refused("a.mha", std::string(1 << 20, 'N'));
  refused(
      "a.mha",
      mha_start +
          "DimSize = 2147483648 2147483648 2147483648\nElementType = MET_DOUBLE\nElementDataFile = LOCAL\n");
  refused("a.mha", mha_start +
                       "DimSize = 100000 100000 100\nCompressedData = True\nElementType = "
                       "MET_UCHAR\nElementDataFile = LOCAL\nx");
  refused("a.mha",
          mha_start + "DimSize = 2 2 nan\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh");
  refused("a.mha",
          mha_start + "DimSize = -2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh");
  refused("a.mha",
          mha_start + "DimSize = 2 2 2\nElementType = MET_STRING\nElementDataFile = LOCAL\nabcdefgh");
  refused("a.mha", mha_start + "DimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = ../secret.raw\n");
  refused("a.mha", mha_start + "DimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = missing.raw\n");
  refused("a.mha", mha_start +
                       "ElementNumberOfChannels = 3\nDimSize = 2 2 2\nElementType = "
                       "MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh");
  refused("a.nrrd", nrrd_start + "type: block\nencoding: raw\n\nabcdefgh");
  refused("a.nrrd", nrrd_start + "type: uint8\nencoding: bzip2\n\nabcdefgh");
  refused("a.nrrd", nrrd_start + "type: short\nencoding: raw\n\nabcdefghabcdefgh");  // no endian
  BOOST_TEST(message_of(folder / "missing.mha") != "accepted");
  BOOST_TEST(message_of(folder.path()) != "accepted");
}

BOOST_AUTO_TEST_CASE(volume_is_written_whole_or_not_at_all) {
  const TemporaryFolder folder;
  Volume volume = ramp();
  BOOST_CHECK_THROW(write_volume(folder / "v.png", volume), InputError);
  BOOST_CHECK_THROW(write_volume(folder / "no/such/v.mha", volume), FileError);
  volume.samples.pop_back();
  BOOST_CHECK_THROW(write_volume(folder / "v.mha", volume), InputError);
  BOOST_TEST(std::filesystem::is_empty(folder.path()));
}

BOOST_AUTO_TEST_CASE(memory_limit_is_honoured) {
  const TemporaryFolder folder;
  write_volume(folder / "v.mha", ramp());
  BOOST_CHECK_THROW(static_cast<void>(read_volume(folder / "v.mha", 10)), ResourceError);
}

BOOST_AUTO_TEST_CASE(every_scalar_type_is_read_in_both_byte_orders) {
  const TemporaryFolder folder;
  for (const auto& type : scalar_types)
    for (const bool big : {false, true}) {
      BOOST_TEST_CONTEXT(type.met << (big ? ", big-endian" : ", little-endian")) {
        const std::string samples = type.samples(big);
        check_counted(read_volume(folder.file(
                          "v.mha", mha_start + "BinaryDataByteOrderMSB = " + (big ? "True" : "False") +
                                       "\nDimSize = 2 2 2\nElementType = " + type.met +
                                       "\nElementDataFile = LOCAL\n" + samples)),
                      type.is_signed);
        const std::string nrrd = nrrd_start + "type: " + type.nrrd + "\nendian: " + (big ? "big" : "little");
        check_counted(read_volume(folder.file("v.nrrd", nrrd + "\nencoding: raw\n\n" + samples)),
                      type.is_signed);
        check_counted(read_volume(folder.file("v.nrrd", nrrd + "\nencoding: gzip\n\n" + deflated(samples))),
                      type.is_signed);
      }
    }
}

BOOST_AUTO_TEST_CASE(hdf5_datasets_of_every_type_are_read_with_axes_turned) {
  const TemporaryFolder folder;
  const auto path = folder / "v.h5";
  const std::filesystem::path name = path.string() + ":/volume";
  BOOST_TEST(is_volume_input(name));
  BOOST_TEST((file_of_volume(name) == path));
  for (const hid_t type : {H5T_STD_U8LE, H5T_STD_I16BE, H5T_STD_U16LE, H5T_STD_I32BE, H5T_STD_I32LE,
                           H5T_IEEE_F32BE, H5T_IEEE_F32LE, H5T_IEEE_F64LE, H5T_IEEE_F64BE}) {
    write_hdf5(path, type, {4, 3, 2}, {{"spacing", {3, 2, 1}}, {"origin", {30, 20, -10}}});
    const Volume volume = read_volume(name);
    BOOST_TEST((volume.grid.cells == Index3{1, 2, 3}));
    BOOST_TEST((volume.grid.spacing == Vec3{1, 2, 3}));
    BOOST_TEST((volume.grid.origin == Vec3{-10, 20, 30}));
    check_counting(volume);
  }
  write_hdf5(path, H5T_STD_U8LE, {2, 2, 2}, {{"element_size_um", {5, 4, 3}}});
  BOOST_TEST((read_volume(name).grid.spacing == Vec3{3, 4, 5}));
  BOOST_TEST(read_volume(name).grid.unit == "um");
}

BOOST_AUTO_TEST_CASE(hdf5_datasets_that_are_no_volume_are_refused) {
  const TemporaryFolder folder;
  const auto path = folder / "v.h5";
  const auto refused = [&](const std::string& dataset, const std::string& reason) {
    const std::string what = message_of(path.string() + ":" + dataset);
    BOOST_TEST(what.find(reason) != std::string::npos, what);
    BOOST_TEST(what.find(path.string()) != std::string::npos, what);
  };
  refused("/volume", "cannot be opened");
  write_hdf5(path, H5T_STD_U8LE, {4, 3});
  refused("/volume", "2 axes");
  refused("/other", "no such dataset");
  write_hdf5(path, H5T_STD_U8LE, {4, 3, 1});
  refused("/volume", "at least two");
  write_hdf5(path, H5T_STD_U8LE, {2, 2, 2}, {{"spacing", {1, 1}}});
  refused("/volume", "3 numbers");
  write_hdf5(path, H5T_STD_U8LE, {2, 2, 2}, {{"spacing", {1, 0, 1}}});
  refused("/volume", "spacing");
  write_hdf5(path, H5T_STD_U8LE, {16, 16, 16});
  const std::string whole = support::bytes_of(path);
  static_cast<void>(folder.file("v.h5", whole.substr(0, whole.size() / 2)));
  refused("/volume", "truncated");
  BOOST_CHECK_THROW(static_cast<void>(read_volume(path)), FileError);

  // An axis longer than it may ever be, as damage leaves it: the dimensions stand before their maxima.
  write_hdf5(path, H5T_STD_U8LE, {5, 4, 3});
  std::string bytes = support::bytes_of(path);
  const std::uint64_t dimensions[] = {5, 4, 3, 5, 4, 3};
  const auto at = bytes.find(std::string(reinterpret_cast<const char*>(dimensions), sizeof dimensions));
  BOOST_REQUIRE(at != std::string::npos);
  bytes[at + 2] = 2;
  static_cast<void>(folder.file("v.h5", bytes));
  // HDF5 1.14 looks for that itself.
  const std::string longer = message_of(path.string() + ":/volume");
  BOOST_TEST((longer.find("largest extent") != std::string::npos ||
              longer.find("cannot be opened (HDF5: ") != std::string::npos),
             longer);
  BOOST_TEST(longer.find("gives no reason") == std::string::npos, longer);

  // Numbers longer than any machine's, for which HDF5 would copy far beyond a short chunk.
  const hid_t wide = H5Tcopy(H5T_STD_U8LE);
  H5Tset_size(wide, 24);
  H5Tset_precision(wide, 192);
  write_hdf5(path, wide, {4, 4, 4});
  H5Tclose(wide);
  refused("/volume", "24 bytes long");

  // There, but of a type of version 15, which no HDF5 has.
  write_hdf5(path, H5T_STD_U8LE, {4, 4, 4});
  bytes = support::bytes_of(path);
  const auto type = bytes.find(std::string("\x10\0\0\0\x01\0\0\0\0\0\x08\0", 12));
  BOOST_REQUIRE(type != std::string::npos);
  bytes[type] = '\xf0';
  static_cast<void>(folder.file("v.h5", bytes));
  refused("/volume", "cannot be opened (HDF5: ");
}

BOOST_AUTO_TEST_CASE(tiff_slices_are_stacked_along_z_in_natural_order) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "slices");
  for (int i = 0; i < 11; ++i) write_tiff(folder / ("slices/s" + std::to_string(i) + ".tif"), 6 * i, 1);
  BOOST_TEST(is_volume_input(folder / "slices"));
  const Volume volume = read_volume(folder / "slices");
  BOOST_TEST((volume.grid.cells == Index3{2, 1, 10}));
  check_counting(volume);
  write_tiff(folder / "slices/s11.tif", 66, 1, "w", "", 4);
  BOOST_TEST(message_of(folder / "slices").find("s11.tif") != std::string::npos);
  static_cast<void>(folder.file("slices/scan.json", "{}"));
  BOOST_TEST(!is_volume_input(folder / "slices"));
}

BOOST_AUTO_TEST_CASE(tiff_files_of_several_images_are_read_with_the_tags_of_imagej) {
  const TemporaryFolder folder;
  for (const char* mode : {"wl", "wb"}) {  // little- and big-endian
    write_tiff(folder / "v.tif", 0, 4, mode, "ImageJ=1.53\nimages=4\nunit=um\nspacing=0.75\n");
    const Volume volume = read_volume(folder / "v.tif");
    BOOST_TEST((volume.grid.cells == Index3{2, 1, 3}));
    BOOST_TEST((volume.grid.spacing == Vec3{0.25, 0.5, 0.75}));
    BOOST_TEST(volume.grid.unit == "um");
    check_counting(volume);
  }
  const std::string whole = support::bytes_of(folder / "v.tif");
  BOOST_TEST(message_of(folder.file("cut.tif", whole.substr(0, whole.size() / 2))) != "accepted");
  write_tiff(folder / "v.tif", 0, 1);
  BOOST_TEST(message_of(folder / "v.tif").find("at least two") != std::string::npos);
  write_tiff(folder / "v.tif", 0, 1, "w", "ImageJ=1.53\nimages=4000\n");
  BOOST_TEST(message_of(folder / "v.tif").find("truncated") != std::string::npos);
  for (const char* count : {"0", "-3", "nan", "1e300", "x"}) {
    write_tiff(folder / "v.tif", 0, 1, "w", std::string("ImageJ=1.53\nimages=") + count + "\n");
    BOOST_TEST(message_of(folder / "v.tif").find("images=") != std::string::npos);
  }
  write_tiff(folder / "v.tif", 0, 4, "w", "ImageJ=1.53\nimages=4\nchannels=2\nslices=2\n");
  BOOST_TEST(message_of(folder / "v.tif").find("2 channels") != std::string::npos);
  write_tiff(folder / "v.tif", 0, 4, "w", "ImageJ=1.53\nimages=4\nslices=2\nframes=2\n");
  BOOST_TEST(message_of(folder / "v.tif").find("2 time points") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(one_directory_of_imagej_holds_images_behind_each_other) {
  const TemporaryFolder folder;
  for (const char* mode : {"wl", "wb"}) {
    write_tiff(folder / "v.tif", 0, 1, mode,
               "ImageJ=1.53\nimages=3\nslices=3\nunit=um\nspacing=0.75\nxorigin=4\nyorigin=-2\n");
    // The first image lies where its strip is, and libtiff puts the directory behind it; ImageJ before.
    const std::string file = support::bytes_of(folder / "v.tif");
    std::string head = file, tail;
    const bool big = mode[1] == 'b';
    for (int i = 0; i < 18; ++i)
      tail += big ? std::string{'\0', static_cast<char>(i)} : std::string{static_cast<char>(i), '\0'};
    // The strip's offset, in the last entry of its kind, is moved to the end of the file.
    const std::string tag = big ? std::string("\x01\x11\x00\x04\x00\x00\x00\x01", 8)
                                : std::string("\x11\x01\x04\x00\x01\x00\x00\x00", 8);
    const auto at = file.find(tag);
    BOOST_REQUIRE(at != std::string::npos);
    for (std::size_t b = 0; b < 4; ++b)
      head[at + 8 + b] = static_cast<char>(file.size() >> (8 * (big ? 3 - b : b)) & 0xff);
    const Volume volume = read_volume(folder.file("j.tif", head + tail));
    BOOST_TEST((volume.grid.cells == Index3{2, 1, 2}));
    BOOST_TEST((volume.grid.spacing == Vec3{0.25, 0.5, 0.75}));
    BOOST_TEST((volume.grid.origin == Vec3{-1, 1, 0}));
    check_counting(volume);
    for (std::size_t less = 1; less < 36; less += 5)
      BOOST_TEST(message_of(folder.file("cut.tif", head + tail.substr(0, 36 - less))).find("truncated") !=
                 std::string::npos);
  }
}

BOOST_AUTO_TEST_CASE(files_of_one_image_and_of_several_make_one_stack) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "s");
  write_tiff(folder / "s/a_1.tif", 0, 2);
  write_tiff(folder / "s/a_2.tif", 12, 1);
  write_tiff(folder / "s/a_10.tif", 18, 3);
  const Volume volume = read_volume(folder / "s");
  BOOST_TEST((volume.grid.cells == Index3{2, 1, 5}));
  check_counting(volume);
  io::TiffSeries series({folder / "s/a_1.tif", folder / "s/a_2.tif", folder / "s/a_10.tif"});
  BOOST_TEST(series.stack().images == 6);
  std::vector<double> image(6);
  for (const std::int64_t k : {5, 0, 3, 1, 2, 4}) {  // in any order
    series.read(k, image.data());
    for (int p = 0; p < 6; ++p)
      BOOST_TEST(image[static_cast<std::size_t>(p)] == 6 * static_cast<double>(k) + p);
  }
  BOOST_TEST(series.file_of(1) == 0u);
  BOOST_TEST(series.file_of(2) == 1u);
  BOOST_TEST(series.file_of(5) == 2u);
  BOOST_TEST(series.name(2) == (folder / "s/a_2.tif").string());
  BOOST_TEST(series.name(4) == (folder / "s/a_10.tif").string() + ", image 1");
  // 6 pixels as double are 48 bytes.
  BOOST_CHECK_THROW(io::TiffSeries({folder / "s/a_1.tif"}, 47), ResourceError);
}

BOOST_AUTO_TEST_CASE(what_imagej_calibrates_by_a_line_is_read_as_what_it_stands_for) {
  const TemporaryFolder folder;
  write_tiff(folder / "v.tif", 0, 2, "w", "ImageJ=1.53\nimages=2\ncf=0\nc0=-32768.0\nc1=0.5\n");
  const Volume volume = read_volume(folder / "v.tif");
  for (std::size_t i = 0; i < volume.samples.size(); ++i)
    BOOST_TEST(volume.samples[i] == -32768 + 0.5f * static_cast<float>(i));
  write_tiff(folder / "w.tif", 0, 2, "w", "ImageJ=1.53\nimages=2\ncf=20\nc0=-32768.0\nc1=0.5\n");
  check_counting(read_volume(folder / "w.tif"));
}
