// zlib's streams, in pieces so that a stop is seen between them.
#include "host/export/pack.hpp"

#include <zlib.h>

#include <algorithm>

#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {

Bytes packed(std::span<const std::byte> bytes, Wrapper wrapper, int level) {
  constexpr int window = 15, memory = 8, gzip_header = 16;
  constexpr std::size_t piece = std::size_t{1} << 20;
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, window + (wrapper == Wrapper::gzip ? gzip_header : 0), memory,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    throw ResourceError("zlib: no memory to compress with");
  struct End {
    z_stream* stream;
    ~End() { deflateEnd(stream); }
  } const end{&stream};
  Bytes out(deflateBound(&stream, static_cast<uLong>(bytes.size())));
  std::size_t taken = 0, made = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    throw_if_stopped();
    const std::size_t n = std::min(piece, bytes.size() - taken);
    // zlib's interface asks for a pointer that is not const, and does not write there.
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data() + taken));
    stream.avail_in = static_cast<uInt>(n);
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + made);
    stream.avail_out = static_cast<uInt>(std::min<std::size_t>(out.size() - made, std::size_t{1} << 30));
    const uInt room = stream.avail_out;
    taken += n;
    state = deflate(&stream, taken == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    if (state == Z_STREAM_ERROR || state == Z_BUF_ERROR) throw ResourceError("zlib: cannot compress");
    taken -= stream.avail_in;
    made += room - stream.avail_out;
  }
  out.resize(made);
  return out;
}

Bytes shuffled(std::span<const std::byte> bytes, std::size_t element_bytes) {
  Bytes out(bytes.size());
  const std::size_t count = bytes.size() / element_bytes;
  for (std::size_t b = 0; b < element_bytes; ++b)
    for (std::size_t i = 0; i < count; ++i) out[b * count + i] = bytes[i * element_bytes + b];
  return out;
}

}  // namespace vdvr
