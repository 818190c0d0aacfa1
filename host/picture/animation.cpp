// Moving pictures: APNG (the chunks of the PNG specification, third edition, around frames that are PNG
// already) and GIF through giflib, with our own palette.
#include "vdvr/expert/animation.hpp"

#include <fmt/format.h>
#include <gif_lib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>

#include "host/base/system/png.hpp"
#include "host/picture/palette.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {
namespace {

void check_frames(const std::filesystem::path& path, const std::vector<Image>& frames, int frame_ms) {
  if (frames.empty()) throw InputError(fmt::format("{}: there are no frames to write", path.string()));
  if (frame_ms < 1 || frame_ms > 65535)
    throw InputError(fmt::format("{}: {} ms a frame; 1 to 65535 can be written", path.string(), frame_ms));
  for (const auto& f : frames)
    if (f.width != frames[0].width || f.height != frames[0].height || f.width < 1 || f.height < 1 ||
        f.rgb.size() != static_cast<std::size_t>(3 * f.width * f.height))
      throw InputError(fmt::format("{}: frames of {} x {} and {} x {} pixels", path.string(), frames[0].width,
                                   frames[0].height, f.width, f.height));
}

// --- APNG ---

void append_u32(std::string& out, std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(v >> shift));
}

void append_u16(std::string& out, std::uint32_t v) {
  out.push_back(static_cast<char>(v >> 8));
  out.push_back(static_cast<char>(v));
}

void append_chunk(std::string& out, const std::string& type, const std::string& data) {
  append_u32(out, static_cast<std::uint32_t>(data.size()));
  const std::string body = type + data;
  out += body;
  append_u32(out, static_cast<std::uint32_t>(
                      crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()))));
}

struct Chunk {
  std::string type, data;
};

/// The chunks of a PNG that we encoded ourselves.
std::vector<Chunk> chunks_of(const std::string& png) {
  constexpr std::size_t signature = 8, frame = 12;
  std::vector<Chunk> chunks;
  for (std::size_t at = signature; at + frame <= png.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(png[at + i]);
    chunks.push_back({png.substr(at + 4, 4), png.substr(at + 8, length)});
    at += frame + length;
  }
  return chunks;
}

/// fcTL: the whole picture, replaced.
std::string frame_control(std::uint32_t sequence, const Image& image, int frame_ms) {
  std::string data;
  append_u32(data, sequence);
  append_u32(data, static_cast<std::uint32_t>(image.width));
  append_u32(data, static_cast<std::uint32_t>(image.height));
  append_u32(data, 0);
  append_u32(data, 0);
  append_u16(data, static_cast<std::uint32_t>(frame_ms));
  append_u16(data, 1000);
  data.append(2, '\0');
  return data;
}

// --- GIF ---

int append_gif(GifFileType* gif, const GifByteType* bytes, int count) {
  static_cast<std::string*>(gif->UserData)
      ->append(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(count));
  return count;
}

struct CloseGif {
  void operator()(GifFileType* gif) const { EGifCloseFile(gif, nullptr); }
};

class GifWriter {
 public:
  GifWriter(std::string name, const Image& first, const Palette& palette) : name_(std::move(name)) {
    int code = 0;
    gif_.reset(EGifOpen(&bytes_, append_gif, &code));
    if (!gif_) throw ResourceError(fmt::format("{}: {}", name_, GifErrorString(code)));
    EGifSetGifVersion(gif_.get(), true);
    const std::unique_ptr<ColorMapObject, decltype(&GifFreeMapObject)> map(GifMakeMapObject(256, nullptr),
                                                                           &GifFreeMapObject);
    if (!map) throw ResourceError(fmt::format("{}: no memory for the palette", name_));
    for (std::size_t i = 0; i < palette.colours.size(); ++i)
      map->Colors[i] = {palette.colours[i][0], palette.colours[i][1], palette.colours[i][2]};
    check(EGifPutScreenDesc(gif_.get(), static_cast<int>(first.width), static_cast<int>(first.height), 8, 0,
                            map.get()));
    const std::array<GifByteType, 3> for_ever{1, 0, 0};
    check(EGifPutExtensionLeader(gif_.get(), APPLICATION_EXT_FUNC_CODE));
    check(EGifPutExtensionBlock(gif_.get(), 11, "NETSCAPE2.0"));
    check(EGifPutExtensionBlock(gif_.get(), static_cast<int>(for_ever.size()), for_ever.data()));
    check(EGifPutExtensionTrailer(gif_.get()));
  }

  void add(const Image& image, std::vector<std::uint8_t> indices, int hundredths) {
    const std::array<GifByteType, 4> control{0, static_cast<GifByteType>(hundredths & 0xff),
                                             static_cast<GifByteType>(hundredths >> 8), 0};
    check(EGifPutExtension(gif_.get(), GRAPHICS_EXT_FUNC_CODE, static_cast<int>(control.size()),
                           control.data()));
    const int width = static_cast<int>(image.width), height = static_cast<int>(image.height);
    check(EGifPutImageDesc(gif_.get(), 0, 0, width, height, false, nullptr));
    for (int y = 0; y < height; ++y)
      check(EGifPutLine(gif_.get(), indices.data() + static_cast<std::ptrdiff_t>(y) * width, width));
  }

  std::string finish() {
    int code = 0;
    if (EGifCloseFile(gif_.release(), &code) != GIF_OK)
      throw ResourceError(fmt::format("{}: {}", name_, GifErrorString(code)));
    return std::move(bytes_);
  }

 private:
  void check(int result) const {
    if (result != GIF_OK) throw ResourceError(fmt::format("{}: {}", name_, GifErrorString(gif_->Error)));
  }

  std::string name_, bytes_;
  std::unique_ptr<GifFileType, CloseGif> gif_;
};

}  // namespace

void write_apng(const std::filesystem::path& path, const std::vector<Image>& frames, int frame_ms) {
  check_frames(path, frames, frame_ms);
  std::string out;
  std::uint32_t sequence = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const std::string png = encode_png(path, frames[f]);
    for (const Chunk& chunk : chunks_of(png)) {
      if (f == 0 && chunk.type == "IHDR") {
        out = png.substr(0, 8);
        append_chunk(out, chunk.type, chunk.data);
        std::string control;
        append_u32(control, static_cast<std::uint32_t>(frames.size()));
        append_u32(control, 0);  // for ever
        append_chunk(out, "acTL", control);
        append_chunk(out, "fcTL", frame_control(sequence++, frames[f], frame_ms));
      } else if (f > 0 && chunk.type == "IHDR") {
        append_chunk(out, "fcTL", frame_control(sequence++, frames[f], frame_ms));
      } else if (chunk.type == "IDAT" && f == 0) {
        append_chunk(out, chunk.type, chunk.data);
      } else if (chunk.type == "IDAT") {
        std::string data;
        append_u32(data, sequence++);
        append_chunk(out, "fdAT", data + chunk.data);
      }
    }
  }
  append_chunk(out, "IEND", "");
  io::write_file(path, out);
}

void write_gif(const std::filesystem::path& path, const std::vector<Image>& frames, int frame_ms) {
  check_frames(path, frames, frame_ms);
  if (frames[0].width > 65535 || frames[0].height > 65535)
    throw InputError(fmt::format("{}: a GIF has at most 65535 pixels a side", path.string()));
  const Palette palette = palette_of(frames);
  GifWriter gif(path.string(), frames[0], palette);
  const int hundredths = std::max(1, (frame_ms + 5) / 10);
  for (const auto& frame : frames) gif.add(frame, dithered(palette, frame), hundredths);
  io::write_file(path, gif.finish());
}

}  // namespace vdvr
