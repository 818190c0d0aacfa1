// MetaImage, NRRD, NPY, raw.
#include "host/export/volume_sink.hpp"

#include <fmt/format.h>

#include <bit>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/base/system/limits.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/volume_file.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "samples are written as they lie in memory");

class RasterSink : public VolumeSink {
 public:
  RasterSink(const fs::path& path, const ExportNote& note) : path_(path), writer_(path, note.grid) {}
  void put(std::int64_t, std::span<const std::byte> planes) override {
    writer_.append({reinterpret_cast<const float*>(planes.data()), planes.size() / sizeof(float)});
  }
  std::uint64_t commit() override {
    writer_.commit();
    return fs::file_size(path_);
  }

 private:
  fs::path path_;
  VolumeWriter writer_;
};

/// Magic, version, length, and a Python dictionary padded so that the samples begin at a multiple of 64
/// bytes.
std::string npy_header(const ExportNote& note) {
  const Index3 n = note.grid.samples();
  const char* type = note.samples == SampleType::f32   ? "<f4"
                     : note.samples == SampleType::u16 ? "<u2"
                                                       : "|u1";
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}, {}), }}", type,
                                 n[2], n[1], n[0]);
  constexpr std::size_t before = 10, multiple = 64;
  while ((before + text.size() + 1) % multiple != 0) text += ' ';
  text += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(text.size() & 0xff);
  header += static_cast<char>(text.size() >> 8);
  return header + text;
}

class FlatSink : public VolumeSink {
 public:
  FlatSink(const fs::path& path, const ExportNote& note, bool npy)
      : path_(path),
        text_(note_json(note, path.filename().string()).dump(2) + "\n"),
        expected_(io::checked_bytes(note.grid.samples(), bytes_of(note.samples), path.string())),
        file_(files_.add(path)),
        note_(files_.add(note_path(path))),
        stream_(file_, std::ios::binary | std::ios::trunc) {
    require_disk(path, file_, expected_);
    const std::string header = npy ? npy_header(note) : "";
    expected_ += header.size();
    stream_ << header;
  }
  void put(std::int64_t, std::span<const std::byte> planes) override {
    stream_.write(reinterpret_cast<const char*>(planes.data()), static_cast<std::streamsize>(planes.size()));
    if (!stream_)
      throw ResourceError(fmt::format("{}: cannot be written; is the disk full?", path_.string()));
  }
  std::uint64_t commit() override {
    stream_.close();
    std::error_code unknown;
    if (!stream_ || fs::file_size(file_, unknown) != expected_)
      throw ResourceError(fmt::format("{}: cannot be written; is the disk full?", path_.string()));
    std::ofstream(note_, std::ios::binary) << text_;
    files_.commit();
    return expected_ + text_.size();
  }

 private:
  fs::path path_;
  std::string text_;
  std::uint64_t expected_;
  io::AtomicFiles files_;
  fs::path file_, note_;
  std::ofstream stream_;
};

}  // namespace

std::unique_ptr<VolumeSink> raster_sink(const fs::path& path, const ExportNote& note) {
  return std::make_unique<RasterSink>(path, note);
}

std::unique_ptr<VolumeSink> flat_sink(const fs::path& path, const ExportNote& note, bool npy) {
  return std::make_unique<FlatSink>(path, note, npy);
}

fs::path note_path(const fs::path& path) { return path.string() + ".json"; }

void require_disk(const fs::path& shown, const fs::path& beside, std::uint64_t bytes) {
  std::error_code unknown;
  const fs::space_info disk = fs::space(beside, unknown);
  if (unknown || disk.available >= bytes) return;
  throw ResourceError(fmt::format(
      "{}: takes {:.1f} MiB, but only {:.1f} MiB of its disk are free; write it to "
      "another, or choose a smaller `oversampling`",
      shown.string(), static_cast<double>(bytes) / 0x1p20, static_cast<double>(disk.available) / 0x1p20));
}

}  // namespace vdvr
