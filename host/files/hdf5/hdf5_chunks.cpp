// See hdf5_chunks.hpp. HDF5 finds a chunk and hands out its stored bytes; everything after that is here.
// A stored chunk: shuffle, then deflate, where the dataset has them; then Fletcher32, 4 bytes, little-endian.
#define H5Dread_chunk_vers 1  // HDF5 2.0 has a second one, with another argument
#include "host/files/hdf5/hdf5_chunks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <vector>

namespace vdvr::io::hdf5 {

// --- how a dataset is stored ---

namespace {

std::string filter_name(H5Z_filter_t filter) {
  switch (filter) {
    case H5Z_FILTER_DEFLATE:
      return "deflate";
    case H5Z_FILTER_SHUFFLE:
      return "shuffle";
    case H5Z_FILTER_FLETCHER32:
      return "Fletcher32";
    case H5Z_FILTER_SZIP:
      return "szip";
    case H5Z_FILTER_NBIT:
      return "n-bit";
    case H5Z_FILTER_SCALEOFFSET:
      return "scale-offset";
    default:
      return fmt::format("HDF5's number {}", filter);
  }
}

/// Chunks that the file has; nothing when their index cannot be read.
std::optional<hsize_t> stored_chunks(const Dataset& d) {
  const Handle space(H5Dget_space(d.id.id()), H5Sclose);
  hsize_t chunks = 0;
  if (H5Dget_num_chunks(d.id.id(), space.id(), &chunks) < 0) return std::nullopt;
  return chunks;
}

/// Accepts what is written here and nothing else.
std::optional<std::string> check_filters(Dataset& d) {
  const Filters& filters = d.filters;
  if (std::find(filters.begin(), filters.end(), H5Z_FILTER_FLETCHER32) == filters.end())
    return "has no Fletcher32 checksum";
  d.packing.shuffled = filters == Filters{H5Z_FILTER_SHUFFLE, H5Z_FILTER_DEFLATE, H5Z_FILTER_FLETCHER32};
  d.packing.deflated = d.packing.shuffled || filters == Filters{H5Z_FILTER_DEFLATE, H5Z_FILTER_FLETCHER32};
  if (d.packing.deflated || filters == Filters{H5Z_FILTER_FLETCHER32}) return std::nullopt;
  std::vector<std::string> names;
  for (const H5Z_filter_t filter : filters) names.push_back(filter_name(filter));
  return fmt::format(
      "went through the filters {}; read is Fletcher32, alone or after deflate or after shuffle "
      "and deflate: h5repack -f FLET rewrites the file",
      fmt::join(names, ", "));
}

/// Before anything is inflated: what the shape promises can lie in what is stored, and one chunk is no larger
/// than the whole.
std::optional<std::string> check_deflated(const Dataset& d, std::uint64_t chunks, std::uint64_t file_bytes) {
  if (d.stored_bytes > file_bytes)
    return fmt::format("claims {} bytes in a file of {}", d.stored_bytes, file_bytes);
  for (std::size_t a = 0; a < d.chunk.size(); ++a)
    if (d.chunk[a] > d.shape[a])
      return fmt::format("has chunks of [{}], larger than its shape [{}]", fmt::join(d.chunk, ", "),
                         fmt::join(d.shape, ", "));
  const std::uint64_t inflated = saturating_product(chunks, d.chunk_bytes);
  if (inflated / most_inflation > d.stored_bytes)
    return fmt::format("claims {} bytes deflated to {}, more than deflate can do: incomplete", inflated,
                       d.stored_bytes);
  const auto stored = stored_chunks(d);
  if (!stored) return "has an index that cannot be read";
  if (*stored != chunks)
    return fmt::format("{} chunks are stored where its shape needs {}: incomplete", *stored, chunks);
  return std::nullopt;
}

/// Without compression the stored size follows from the shape; anything else means missing chunks, or chunks
/// left out of the checksum.
std::optional<std::string> check_plain(const Dataset& d, std::uint64_t chunks, std::uint64_t file_bytes) {
  const std::uint64_t expected = saturating_product(chunks, d.chunk_bytes + fletcher32_bytes);
  if (d.stored_bytes == expected && expected <= file_bytes) return std::nullopt;
  return fmt::format("{} bytes are stored where its shape needs {}, in a file of {}: incomplete",
                     d.stored_bytes, expected, file_bytes);
}

}  // namespace

std::uint64_t saturating_product(std::uint64_t a, std::uint64_t b) {
  std::uint64_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::uint64_t>::max() : product;
}

std::optional<std::string> check_storage(Dataset& d, std::uint64_t file_bytes) {
  if (d.layout != H5D_CHUNKED) return "is not chunked, so it carries no checksum";
  if (auto problem = check_filters(d)) return problem;
  if (d.chunk.size() != d.shape.size() ||
      std::find(d.chunk.begin(), d.chunk.end(), std::uint64_t{0}) != d.chunk.end())
    return "has chunks without a size";
  std::uint64_t chunks = 1;
  d.chunk_bytes = d.element_bytes;
  for (std::size_t a = 0; a < d.chunk.size(); ++a) {
    chunks = saturating_product(chunks, (d.shape[a] - 1) / d.chunk[a] + 1);
    d.chunk_bytes = saturating_product(d.chunk_bytes, d.chunk[a]);
  }
  // The chunk as it is stored, as it is, and before its bytes are put in order.
  d.chunk_memory = saturating_product(d.packing.shuffled ? 3 : 2, d.chunk_bytes);
  d.stored_bytes = H5Dget_storage_size(d.id.id());
  return d.packing.deflated ? check_deflated(d, chunks, file_bytes) : check_plain(d, chunks, file_bytes);
}

namespace {

/// False when an axis is longer than it may ever be, or its chunks are.
bool extents_fit(const Dataset& d) {
  const bool chunked = d.layout == H5D_CHUNKED;
  if (chunked && d.chunk.size() != d.shape.size()) return false;
  for (std::size_t a = 0; a < d.shape.size(); ++a)
    if (d.largest[a] != H5S_UNLIMITED &&
        (d.shape[a] > d.largest[a] || (chunked && d.chunk[a] > d.largest[a])))
      return false;
  return true;
}

/// False when stored chunks differ in length from what their shape needs: HDF5 1.10 trusts a damaged shape
/// and copies beyond the chunk it read. Only chunks without compression can be told so; a checksum adds four
/// bytes to each.
bool chunks_fit(const Dataset& d) {
  for (const H5Z_filter_t filter : d.filters)
    if (filter != H5Z_FILTER_FLETCHER32 && filter != H5Z_FILTER_SHUFFLE) return true;
  const auto chunks = stored_chunks(d);
  if (d.chunk.empty() || !chunks) return false;
  double bytes = static_cast<double>(d.element_bytes);  // double: a damaged shape may exceed 64 bits
  for (const std::uint64_t n : d.chunk) bytes *= static_cast<double>(n);
  const double n = static_cast<double>(*chunks), stored = static_cast<double>(H5Dget_storage_size(d.id.id()));
  return n * bytes <= stored && stored <= n * (bytes + double{fletcher32_bytes});
}

/// No number of any machine is longer. A damaged length is what HDF5 1.10 takes a chunk to be long by.
constexpr std::uint64_t longest_number_bytes = 16;

}  // namespace

std::optional<std::string> check_extents(const Dataset& d) {
  if (d.element_bytes > longest_number_bytes)
    return fmt::format("is damaged: its numbers are {} bytes long", d.element_bytes);
  if (!extents_fit(d)) return "is damaged: an axis, or its chunks, are longer than its largest extent";
  if (d.layout == H5D_CHUNKED && !chunks_fit(d))
    return "is damaged: its chunks are not as long as their shape says";
  return std::nullopt;
}

// --- what a chunk holds ---

namespace {

/// A 16-bit sum with the carries added back in: 0 only for nothing but zeros.
std::uint32_t folded(std::uint64_t sum) {
  while (sum > 0xffff) sum = (sum & 0xffff) + (sum >> 16);
  return static_cast<std::uint32_t>(sum);
}

/// Undoes shuffle: all first bytes of the elements, then all second ones, and so on.
void gather_elements(std::span<const std::uint8_t> planes, std::size_t element_bytes,
                     std::span<std::uint8_t> elements) {
  const std::size_t count = planes.size() / element_bytes;
  for (std::size_t byte = 0; byte < element_bytes; ++byte)
    for (std::size_t i = 0; i < count; ++i) elements[i * element_bytes + byte] = planes[byte * count + i];
}

std::optional<std::string> inflate_exactly(std::span<const std::uint8_t> from, std::span<std::uint8_t> to) {
  uLongf written = to.size();
  uLong taken = from.size();
  const int status = ::uncompress2(to.data(), &written, from.data(), &taken);
  if (status == Z_MEM_ERROR) throw std::bad_alloc();
  if (status == Z_BUF_ERROR || (status == Z_OK && (written != to.size() || taken != from.size())))
    return fmt::format("does not inflate to its {} bytes", to.size());
  if (status != Z_OK) return std::string("is no deflate stream");
  return std::nullopt;
}

/// Copies the part of a chunk at `at` that lies in the array; the rest of an edge chunk is padding.
class Placement {
 public:
  Placement(const Dataset& d, std::uint8_t* array) : d_(d), array_(array) {}
  void place(const Shape& at, const std::uint8_t* chunk) const { copy(at, 0, 0, chunk, 0); }

 private:
  void copy(const Shape& at, std::size_t axis, std::uint64_t to, const std::uint8_t* chunk,
            std::uint64_t from) const {
    const std::uint64_t n = std::min(d_.chunk[axis], d_.shape[axis] - at[axis]), size = d_.element_bytes;
    to = to * d_.shape[axis] + at[axis];
    from *= d_.chunk[axis];
    if (axis + 1 == at.size()) std::memcpy(array_ + to * size, chunk + from * size, n * size);
    else
      for (std::uint64_t i = 0; i < n; ++i) copy(at, axis + 1, to + i, chunk, from + i);
  }
  const Dataset& d_;
  std::uint8_t* array_;
};

/// The next chunk in C order; false after the last.
bool advance(Shape& at, const Dataset& d) {
  for (std::size_t axis = at.size(); axis-- > 0;) {
    if (d.shape[axis] - at[axis] > d.chunk[axis]) {
      at[axis] += d.chunk[axis];
      return true;
    }
    at[axis] = 0;
  }
  return false;
}

/// The stored bytes of the chunk at `at`.
std::optional<std::string> fetch(const Dataset& d, const Shape& at, std::vector<std::uint8_t>& stored) {
  const std::vector<hsize_t> offset(at.begin(), at.end());
  hsize_t bytes = 0;
  if (H5Dget_chunk_storage_size(d.id.id(), offset.data(), &bytes) < 0 || bytes == 0)
    return std::string("is missing: incomplete");
  if (bytes <= fletcher32_bytes || bytes > most_stored(d.chunk_bytes))
    return fmt::format("is {} bytes long, its shape needs {}", bytes, d.chunk_bytes);
  stored.resize(bytes);
  std::uint32_t left_out = 0;
  if (H5Dread_chunk(d.id.id(), H5P_DEFAULT, offset.data(), &left_out, stored.data()) < 0)
    return std::string("cannot be read");
  if (left_out != 0) return fmt::format("was left out of filters (mask {})", left_out);
  return std::nullopt;
}

}  // namespace

std::uint32_t fletcher32(std::span<const std::uint8_t> bytes) {
  // Sums of 16-bit words, high byte first, and of the sums after each; so many words stay below 64 bits.
  constexpr std::size_t words_at_once = 1 << 16;
  std::uint64_t sum = 0, sum_of_sums = 0;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.size(), at + 2 * words_at_once);
    for (; at + 1 < end; at += 2) {
      sum += static_cast<std::uint32_t>(bytes[at] << 8 | bytes[at + 1]);
      sum_of_sums += sum;
    }
    if (at < end) {  // an odd byte at the very end is the high one of its word
      sum += static_cast<std::uint32_t>(bytes[at++] << 8);
      sum_of_sums += sum;
    }
    sum = folded(sum);
    sum_of_sums = folded(sum_of_sums);
  }
  return folded(sum_of_sums) << 16 | folded(sum);
}

std::optional<std::string> unpack_chunk(std::span<const std::uint8_t> stored, const Packing& packing,
                                        std::size_t element_bytes, std::span<std::uint8_t> chunk) {
  if (stored.size() < fletcher32_bytes) return std::string("is too short for its Fletcher32 checksum");
  const auto content = stored.first(stored.size() - fletcher32_bytes);
  std::uint32_t expected = 0;
  std::memcpy(&expected, stored.data() + content.size(), sizeof expected);
  if (fletcher32(content) != expected) return std::string("does not match its Fletcher32 checksum");
  if (!packing.deflated) {
    if (content.size() != chunk.size())
      return fmt::format("holds {} bytes, its shape needs {}", content.size(), chunk.size());
    std::memcpy(chunk.data(), content.data(), chunk.size());
    return std::nullopt;
  }
  if (!packing.shuffled) return inflate_exactly(content, chunk);
  std::vector<std::uint8_t> planes(chunk.size());
  if (auto problem = inflate_exactly(content, planes)) return problem;
  gather_elements(planes, element_bytes, chunk);
  return std::nullopt;
}

namespace {

/// With buffers for one chunk: as it is stored, and as it is.
class ChunkReader {
 public:
  ChunkReader(const Dataset& d, void* values)
      : d_(d), placement_(d, static_cast<std::uint8_t*>(values)), chunk_(d.chunk_bytes) {}
  std::optional<std::string> read(const Shape& at) {
    auto problem = fetch(d_, at, stored_);
    if (!problem) problem = unpack_chunk(stored_, d_.packing, d_.element_bytes, chunk_);
    if (problem) return fmt::format("chunk at [{}] {}", fmt::join(at, ", "), *problem);
    placement_.place(at, chunk_.data());
    return std::nullopt;
  }
  [[nodiscard]] std::uint64_t stored_bytes() const { return stored_.size(); }

 private:
  const Dataset& d_;
  Placement placement_;
  std::vector<std::uint8_t> stored_, chunk_;
};

}  // namespace

std::optional<std::string> read_chunk(const Dataset& d, const Shape& at, void* values,
                                      std::uint64_t& stored_bytes) {
  ChunkReader reader(d, values);
  auto problem = reader.read(at);
  stored_bytes += reader.stored_bytes();
  return problem;
}

std::optional<std::string> read_chunks(const Dataset& d, void* values) {
  ChunkReader reader(d, values);
  Shape at(d.shape.size(), 0);
  do {
    if (auto problem = reader.read(at)) return problem;
  } while (advance(at, d));
  return std::nullopt;
}

}  // namespace vdvr::io::hdf5
