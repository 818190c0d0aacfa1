// Uncompressed strips: what every reader takes, and tifffile and ImageJ map into memory as they lie.
#include "host/export/tiff_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/files/io/tiff_messages.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

/// A TIFF file that is being written.
class Pages {
 public:
  /// `bytes`: of all samples that will come.
  Pages(const fs::path& file, const fs::path& shown, const ExportNote& note, std::int64_t pages)
      : shown_(shown.string()), note_(note), pages_(pages) {
    const Index3 n = note.grid.samples();
    constexpr std::int64_t longest = std::int64_t{1} << 31;
    if (n[0] >= longest || n[1] >= longest) throw InputError(shown_ + ": a side is too long for TIFF");
    row_bytes_ = static_cast<std::uint64_t>(n[0]) * bytes_of(note.samples);
    page_bytes_ = row_bytes_ * static_cast<std::uint64_t>(n[1]);
    // A strip is a page where that is of reasonable size, so that readers can map it.
    constexpr std::uint64_t largest_strip = std::uint64_t{256} << 20;
    rows_ = static_cast<std::int64_t>(
        std::clamp<std::uint64_t>(largest_strip / row_bytes_, 1, static_cast<std::uint64_t>(n[1])));
    constexpr std::uint64_t classic = (std::uint64_t{1} << 32) - (std::uint64_t{1} << 24),
                            tags_of_page = 1024;
    const bool big = (page_bytes_ + tags_of_page) * static_cast<std::uint64_t>(pages) > classic;
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                   &TIFFOpenOptionsFree);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), io::keep_tiff_message, &message_);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), io::keep_tiff_message, &ignored_);
    tiff_.reset(TIFFOpenExt(file.c_str(), big ? "w8l" : "wl", options.get()));
    if (!tiff_) fail();
  }

  void add(const std::byte* page) {
    const Index3 n = note_.grid.samples();
    TIFF* t = tiff_.get();
    const std::string text = written_ == 0 ? imagej_text(note_, pages_) : "";
    const auto bits = static_cast<int>(8 * bytes_of(note_.samples));
    bool good =
        TIFFSetField(t, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(n[0])) == 1 &&
        TIFFSetField(t, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(n[1])) == 1 &&
        TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, bits) == 1 &&
        TIFFSetField(t, TIFFTAG_SAMPLEFORMAT,
                     note_.samples == SampleType::f32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT) == 1 &&
        TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1) == 1 &&
        TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == 1 &&
        TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(rows_)) == 1 &&
        TIFFSetField(t, TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE) == 1 &&
        TIFFSetField(t, TIFFTAG_XRESOLUTION, 1 / note_.grid.spacing[0]) == 1 &&
        TIFFSetField(t, TIFFTAG_YRESOLUTION, 1 / note_.grid.spacing[1]) == 1 &&
        (text.empty() || TIFFSetField(t, TIFFTAG_IMAGEDESCRIPTION, text.c_str()) == 1);
    std::uint32_t strip = 0;
    for (std::int64_t row = 0; good && row < n[1]; row += rows_, ++strip) {
      const auto bytes =
          static_cast<tmsize_t>(static_cast<std::uint64_t>(std::min(rows_, n[1] - row)) * row_bytes_);
      // libtiff's interface asks for a pointer that is not const; samples in this machine's order stay as
      // they are.
      auto* from = const_cast<std::byte*>(page + static_cast<std::uint64_t>(row) * row_bytes_);
      good = TIFFWriteEncodedStrip(t, strip, from, bytes) == bytes;
    }
    if (!good || TIFFWriteDirectory(t) != 1) fail();
    ++written_;
  }

  void close() {
    if (TIFFFlush(tiff_.get()) != 1 || !message_.empty()) fail();
    tiff_.reset();
  }

  [[nodiscard]] std::uint64_t page_bytes() const { return page_bytes_; }

 private:
  struct Close {
    void operator()(TIFF* t) const { TIFFClose(t); }
  };
  [[noreturn]] void fail() const {
    throw ResourceError(fmt::format("{}: cannot be written{}; is the disk full?", shown_,
                                    message_.empty() ? "" : " (libtiff: " + message_ + ")"));
  }

  std::string shown_, message_, ignored_;
  ExportNote note_;
  std::int64_t pages_, rows_ = 1, written_ = 0;
  std::uint64_t row_bytes_ = 0, page_bytes_ = 0;
  std::unique_ptr<TIFF, Close> tiff_;
};

std::uint64_t volume_bytes(const fs::path& path, const ExportNote& note) {
  return io::checked_bytes(note.grid.samples(), bytes_of(note.samples), path.string());
}

class PagesSink : public VolumeSink {
 public:
  PagesSink(const fs::path& path, const ExportNote& note)
      : path_(path), file_(path), pages_(file_.temporary(), path, note, note.grid.samples()[2]) {
    require_disk(path, file_.temporary(), volume_bytes(path, note));
  }
  void put(std::int64_t, std::span<const std::byte> planes) override {
    for (std::size_t at = 0; at < planes.size(); at += pages_.page_bytes()) pages_.add(planes.data() + at);
  }
  std::uint64_t commit() override {
    pages_.close();
    const std::uint64_t bytes = fs::file_size(file_.temporary());
    file_.commit();
    return bytes;
  }

 private:
  fs::path path_;
  io::AtomicFile file_;
  Pages pages_;
};

class FolderSink : public VolumeSink {
 public:
  FolderSink(const fs::path& path, const ExportNote& note) : path_(path), note_(note), folder_(path) {
    require_disk(path, folder_.temporary(), volume_bytes(path, note));
    for (std::int64_t most = 100000; most < note.grid.samples()[2]; most *= 10) ++digits_;
  }
  void put(std::int64_t first, std::span<const std::byte> planes) override {
    const Index3 n = note_.grid.samples();
    const std::uint64_t bytes = static_cast<std::uint64_t>(n[0] * n[1]) * bytes_of(note_.samples);
    parallel_for(static_cast<std::int64_t>(planes.size() / bytes), {}, "export", [&](std::int64_t i) {
      const std::string name = fmt::format("slice_{:0{}}.tif", first + i, digits_);
      Pages page(folder_.temporary() / name, path_ / name, note_, 1);
      page.add(planes.data() + static_cast<std::uint64_t>(i) * bytes);
      page.close();
    });
  }
  std::uint64_t commit() override {
    io::write_file(folder_.temporary() / "volume.json", note_json(note_, "slice_*.tif").dump(2) + "\n");
    std::uint64_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(folder_.temporary())) bytes += entry.file_size();
    folder_.commit();
    return bytes;
  }

 private:
  fs::path path_;
  ExportNote note_;
  io::AtomicFolder folder_;
  int digits_ = 5;
};

}  // namespace

bool is_tiff_file_name(const fs::path& path) {
  return export_format_of(path) == ExportFormat::tiff && path.has_filename();
}

std::unique_ptr<VolumeSink> tiff_pages_sink(const fs::path& path, const ExportNote& note) {
  return std::make_unique<PagesSink>(path, note);
}

std::unique_ptr<VolumeSink> tiff_folder_sink(const fs::path& path, const ExportNote& note) {
  return std::make_unique<FolderSink>(path, note);
}

}  // namespace vdvr
