// TIFF: strips, tiles, LZW and Deflate, packed samples, several images in directories and behind each other;
// as a row of projections and as a stack of slices.
#include "tests/fuzz/seeds.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/scan_files.hpp"
#include "vdvr/expert/volume_file.hpp"

namespace vdvr::fuzz {
namespace {

using support::write_tiff;

/// Images of 3 x 5 samples, one a directory.
void write_images(const std::filesystem::path& path, int images, int bits, const std::string& description) {
  TIFF* t = TIFFOpen(path.c_str(), "w");
  for (int image = 0; image < images; ++image) {
    TIFFSetField(t, TIFFTAG_IMAGEWIDTH, 5);
    TIFFSetField(t, TIFFTAG_IMAGELENGTH, 3);
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, 3);
    if (!description.empty()) TIFFSetField(t, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    std::array<unsigned char, 10> row{1, 2, 3, 4, 5, 6, 7, 8, 9, static_cast<unsigned char>(image)};
    for (std::uint32_t y = 0; y < 3; ++y) TIFFWriteScanline(t, row.data(), y, 0);
    TIFFWriteDirectory(t);
  }
  TIFFClose(t);
}

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
  write_images(path, 2, 16, "ImageJ=1.53\nimages=2\nunit=um\nspacing=2\ncf=0\nc0=-3\nc1=0.5\n"), add();
  write_images(path, 9, 8, ""), add();
  write_images(path, 3, 12, "ImageJ=1.53\nimages=3\nframes=3\n"), add();
  write_images(path, 1, 16, "ImageJ=1.53\nimages=4\nslices=4\n"), add();  // the others behind it
  all.back() += std::string(4 * 30, '\1');
  return all;
}

// A single image is no volume: both readings are tried, one may be refused. Frames come from last to first.
void read(const std::filesystem::path& file) {
  try {
    static_cast<void>(read_volume(file, memory_limit));
  } catch (const FileError&) {
    io::TiffSeries series({file}, memory_limit);
    std::vector<double> image(static_cast<std::size_t>(series.stack().rows * series.stack().columns));
    for (std::int64_t k = series.stack().images; k > 0; --k) series.read(k - 1, image.data());
  }
}

}  // namespace

const Target fuzz_target{"image.tif", Contents::binary, seeds, read};

}  // namespace vdvr::fuzz
