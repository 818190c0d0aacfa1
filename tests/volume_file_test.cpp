#define BOOST_TEST_MODULE volume_file
#include "vdvr/volume_file.hpp"

#include <zlib.h>

#include <boost/test/data/test_case.hpp>
#include <boost/test/unit_test.hpp>
#include <cstring>
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
    BOOST_TEST(e.exit_code() == 2);
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

BOOST_AUTO_TEST_CASE(turned_or_mirrored_axes_are_refused) {
  const TemporaryFolder folder;
  const std::string rest = "DimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh";
  BOOST_TEST(message_of(folder.file("a.mha", mha_start + "TransformMatrix = -1 0 0 0 1 0 0 0 1\n" + rest))
                 .find("TransformMatrix") != std::string::npos);
  BOOST_TEST(
      message_of(folder.file("b.mha", mha_start + "ElementSpacing = 1 0 1\n" + rest)).find("spacing") !=
      std::string::npos);
  const std::string nrrd = nrrd_start + "type: uint8\nencoding: raw\nspace dimension: 3\n";
  BOOST_TEST(
      message_of(folder.file("a.nrrd", nrrd + "space directions: (1,0,0) (0,-1,0) (0,0,1)\n\nabcdefgh"))
          .find("space directions") != std::string::npos);
  BOOST_TEST(message_of(folder.file(
                 "ok.nrrd", nrrd + "space directions: (1,0,0) (0,2,0) (0,0,1)\n\nabcdefgh")) == "accepted");
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
  BOOST_TEST(message_of(folder / "v.mha").find("sample 5") != std::string::npos);
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
