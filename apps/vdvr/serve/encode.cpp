#include "apps/vdvr/serve/encode.hpp"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <memory>

#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

// Fine enough for a picture that the next one replaces at once.
constexpr int kQuality = 85;

struct End {
  void operator()(void* handle) const { tjDestroy(handle); }
};
struct Free {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

}  // namespace

std::string jpeg_bytes(const Image& image) {
  const std::unique_ptr<void, End> jpeg(tjInitCompress());
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool good = jpeg && tjCompress2(jpeg.get(), image.rgb.data(), static_cast<int>(image.width), 0,
                                        static_cast<int>(image.height), TJPF_RGB, &bytes, &size, TJSAMP_420,
                                        kQuality, TJFLAG_FASTDCT) == 0;
  const std::unique_ptr<unsigned char, Free> owned(bytes);
  if (!good)
    throw ResourceError(fmt::format("a frame of {} x {} pixels cannot be encoded as JPEG: {}", image.width,
                                    image.height, tjGetErrorStr2(jpeg.get())));
  return {reinterpret_cast<const char*>(bytes), size};
}

}  // namespace vdvr::cli
