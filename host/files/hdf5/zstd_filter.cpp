// See zstd_filter.hpp. A frame states its size, and no more than that is allocated or written;
// hdf5_filters.cpp holds that size to the chunk's before HDF5 comes here.
#include "host/files/hdf5/zstd_filter.hpp"

#include <zstd.h>

#include <cstdint>
#include <limits>

namespace vdvr::io::hdf5 {
namespace {

/// The buffer of a filter: HDF5's memory, which the filter may replace.
struct Buffer {
  void** bytes;
  std::size_t* allocated;
};

std::size_t fail(const char* why) {
  H5Epush2(H5E_DEFAULT, "zstd_filter.cpp", "zstd", 0, H5E_ERR_CLS, H5E_PLINE, H5E_CANTFILTER, "%s", why);
  return 0;
}

/// `code(to, n)` fills n bytes, and gives how many it wrote or libzstd's error.
template <class Code>
std::size_t replace(Buffer buffer, std::size_t n, const Code& code) {
  void* const out = H5allocate_memory(n, false);
  if (out == nullptr) return fail("zstd: not enough memory");
  const std::size_t written = code(out, n);
  if (ZSTD_isError(written) != 0) {
    H5free_memory(out);
    return fail(ZSTD_getErrorName(written));
  }
  H5free_memory(*buffer.bytes);
  *buffer.bytes = out;
  *buffer.allocated = n;
  return written;
}

std::size_t unpack(Buffer buffer, std::size_t stored) {
  const unsigned long long stated = ZSTD_getFrameContentSize(*buffer.bytes, stored);
  // libzstd's two codes for an error are larger than any size. HDF5 counts a chunk's bytes in 32 bits.
  if (stated == 0 || stated > std::numeric_limits<std::uint32_t>::max())
    return fail("zstd: no frame that states its size");
  return replace(buffer, static_cast<std::size_t>(stated),
                 [&](void* to, std::size_t n) { return ZSTD_decompress(to, n, *buffer.bytes, stored); });
}

std::size_t pack(Buffer buffer, std::size_t plain, int level) {
  return replace(buffer, ZSTD_compressBound(plain),
                 [&](void* to, std::size_t n) { return ZSTD_compress(to, n, *buffer.bytes, plain, level); });
}

std::size_t apply(unsigned flags, std::size_t parameters, const unsigned* values, std::size_t n,
                  std::size_t* allocated, void** bytes) {
  const Buffer buffer{bytes, allocated};
  if ((flags & H5Z_FLAG_REVERSE) != 0) return unpack(buffer, n);
  return pack(buffer, n, parameters > 0 ? static_cast<int>(values[0]) : ZSTD_CLEVEL_DEFAULT);
}

}  // namespace

void register_zstd_filter() {
  static const H5Z_class2_t filter{
      H5Z_CLASS_T_VERS, zstd_filter_number, 1, 1, "zstd", nullptr, nullptr, apply};
  static const herr_t registered = H5Zregister(&filter);
  static_cast<void>(registered);
}

}  // namespace vdvr::io::hdf5
