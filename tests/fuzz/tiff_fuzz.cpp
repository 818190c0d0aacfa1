// TIFF: strips, tiles, LZW and Deflate, several images; as a projection and as a stack of slices.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/scan_files.hpp"
#include "vdvr/volume_file.hpp"

namespace vdvr::fuzz {
namespace {

using support::write_tiff;

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = folder / "seed.tif";
  std::vector<float> samples(19 * 37);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<float>(i % 50);
  const std::vector<std::uint16_t> shorts(samples.begin(), samples.end());
  std::vector<std::string> all;
  const auto add = [&] { all.push_back(support::bytes_of(path)); };
  write_tiff(path, 19, 37, samples, SAMPLEFORMAT_IEEEFP), add();
  write_tiff(path, 19, 37, shorts, SAMPLEFORMAT_UINT, false, COMPRESSION_LZW), add();
  write_tiff(path, 19, 37, shorts, SAMPLEFORMAT_UINT, true, COMPRESSION_ADOBE_DEFLATE), add();
  write_tiff(path, 19, 37, samples, SAMPLEFORMAT_IEEEFP, true), add();
  write_tiff(path, 19, 37, shorts, SAMPLEFORMAT_UINT, false, COMPRESSION_PACKBITS), add();
  // Two images in one file.
  TIFF* t = TIFFOpen(path.c_str(), "w");
  for (int image = 0; image < 2; ++image) {
    TIFFSetField(t, TIFFTAG_IMAGEWIDTH, 5);
    TIFFSetField(t, TIFFTAG_IMAGELENGTH, 3);
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(t, TIFFTAG_IMAGEDESCRIPTION, "ImageJ=1.53\nimages=2\nunit=um\nspacing=2\n");
    for (std::uint32_t y = 0; y < 3; ++y) {
      std::array<std::uint16_t, 5> row{1, 2, 3, 4, 5};
      TIFFWriteScanline(t, row.data(), y, 0);
    }
    TIFFWriteDirectory(t);
  }
  TIFFClose(t);
  add();
  return all;
}

// A single image is no volume, and several are no projection: both readings are tried, one may be refused.
void read(const std::filesystem::path& file) {
  try {
    static_cast<void>(read_volume(file, memory_limit));
  } catch (const FileError&) {
    static_cast<void>(io::read_tiff(file, memory_limit));
  }
}

}  // namespace

const Target fuzz_target{"image.tif", Contents::binary, seeds, read};

}  // namespace vdvr::fuzz
