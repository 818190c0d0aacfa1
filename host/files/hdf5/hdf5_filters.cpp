// See hdf5_filters.hpp. The layouts are those of the registered filters' own sources: LZ4 32004 (The HDF
// Group's hdf5_plugins, LZ4), bitshuffle 32008 (kiyo-masui/bitshuffle), Blosc 32001 (Blosc/c-blosc, header of
// a chunk), LZF 32000 (h5py, lzf), zstd 32015 (RFC 8878).
#define H5Dread_chunk_vers 1  // HDF5 2.0 has a second one, with another argument
#include "host/files/hdf5/hdf5_filters.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <span>

#include "host/files/hdf5/hdf5_chunks.hpp"
#include "host/files/hdf5/zstd_filter.hpp"

namespace vdvr::io::hdf5 {
namespace {

constexpr H5Z_filter_t bzip2 = 307, lzf = 32000, blosc = 32001, lz4 = 32004, bitshuffle = 32008;

struct Known {
  H5Z_filter_t number;
  const char *name, *package;
};
// Of the registered ones those that scans are met with.
constexpr std::array<Known, 11> known{{{bzip2, "bzip2", "hdf5-filter-plugin"},
                                       {lzf, "LZF", "bitshuffle"},
                                       {blosc, "Blosc", "hdf5-filter-plugin-blosc-serial"},
                                       {lz4, "LZ4", "hdf5-filter-plugin"},
                                       {bitshuffle, "bitshuffle", "bitshuffle"},
                                       {32013, "ZFP", ""},
                                       {32017, "SZ", ""},
                                       {32024, "SZ3", ""},
                                       {32026, "Blosc2", ""},
                                       {32018, "FCIDECOMP", ""},
                                       {H5Z_FILTER_SZIP, "szip", ""}}};

using Bytes = std::span<const std::uint8_t>;

std::uint64_t big_endian(Bytes bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

std::uint64_t little_endian_32(Bytes bytes) {
  return bytes[0] | std::uint64_t{bytes[1]} << 8 | std::uint64_t{bytes[2]} << 16 |
         std::uint64_t{bytes[3]} << 24;
}

std::optional<std::string> claims(std::uint64_t stated, std::uint64_t needed) {
  if (stated == needed) return std::nullopt;
  return fmt::format("claims to unpack to {} bytes, its shape needs {}", stated, needed);
}

std::optional<std::string> ends_at(std::uint64_t stated, std::uint64_t stored) {
  if (stated == stored) return std::nullopt;
  return fmt::format("needs {} bytes, {} are stored: truncated or damaged", stated, stored);
}

const std::string too_short = "is too short for its header: truncated or damaged";

/// Where `blocks` packed blocks end that begin at `at`, each after its length in 4 bytes.
std::uint64_t end_of_blocks(Bytes chunk, std::uint64_t at, std::uint64_t blocks) {
  for (; blocks > 0 && at + 4 <= chunk.size(); --blocks) at += 4 + big_endian(chunk.subspan(at, 4));
  return at + 4 * blocks;  // of those that are not there at least their lengths
}

std::optional<std::string> check_lz4(Bytes chunk, std::uint64_t needed) {
  if (chunk.size() < 12) return too_short;
  const std::uint64_t block = big_endian(chunk.subspan(8, 4));
  if (auto problem = claims(big_endian(chunk.first(8)), needed)) return problem;
  if (block == 0) return "has blocks without a size";
  return ends_at(end_of_blocks(chunk, 12, (needed - 1) / block + 1), chunk.size());
}

/// What the filter's parameters in the file say.
struct BitshuffleParameters {
  std::uint64_t element_bytes = 0, compression = 0;
};

std::optional<std::string> check_bitshuffle(Bytes chunk, std::uint64_t needed,
                                            const BitshuffleParameters& p) {
  constexpr std::uint64_t none = 0, with_lz4 = 2;
  if (p.compression == none) return ends_at(needed, chunk.size());
  if (p.compression != with_lz4)
    return fmt::format("is bitshuffle with compression {}; read is LZ4 (2) or none (0)", p.compression);
  if (chunk.size() < 12) return too_short;
  if (auto problem = claims(big_endian(chunk.first(8)), needed)) return problem;
  const std::uint64_t block_bytes = big_endian(chunk.subspan(8, 4));
  if (p.element_bytes == 0 || block_bytes % (8 * p.element_bytes) != 0 || block_bytes == 0)
    return fmt::format("has blocks of {} bytes, not of eight elements", block_bytes);
  // Elements that do not fill a block are one more block, but for the last up to seven, which lie as they
  // are.
  const std::uint64_t elements = needed / p.element_bytes, in_block = block_bytes / p.element_bytes;
  const std::uint64_t blocks = elements / in_block + (elements % in_block >= 8 ? 1 : 0);
  return ends_at(end_of_blocks(chunk, 12, blocks) + elements % 8 * p.element_bytes, chunk.size());
}

std::optional<std::string> check_blosc(Bytes chunk, std::uint64_t needed) {
  if (chunk.size() < 16) return too_short;
  if (auto problem = claims(little_endian_32(chunk.subspan(4, 4)), needed)) return problem;
  return ends_at(little_endian_32(chunk.subspan(12, 4)), chunk.size());
}

std::optional<std::string> check_lzf(Bytes chunk, std::uint64_t needed) {
  std::uint64_t unpacked = 0, at = 0;
  while (at < chunk.size()) {
    const std::uint64_t control = chunk[at++];
    if (control < 32) {  // that many bytes and one more, as they are
      unpacked += control + 1;
      at += control + 1;
      continue;
    }
    std::uint64_t length = control >> 5;
    if (length == 7 && at < chunk.size()) length += chunk[at++];
    unpacked += length + 2;
    ++at;  // the rest of where they are copied from
  }
  if (auto problem = claims(unpacked, needed)) return problem;
  return ends_at(at, chunk.size());
}

/// Its stream states no size, but ends in a mark of 48 bits and a sum of 32, then in up to seven bits of
/// nothing. Debian's plugin does not come to an end where they are missing.
std::optional<std::string> check_bzip2(Bytes chunk) {
  constexpr std::uint64_t mark = 0x177245385090, bits_48 = (std::uint64_t{1} << 48) - 1;
  constexpr std::size_t longest_end = 11;
  if (chunk.size() >= longest_end)
    for (int unused = 0; unused < 8; ++unused)
      if ((big_endian(chunk.last(longest_end).first(7)) >> unused & bits_48) == mark) return std::nullopt;
  return "is no whole bzip2 stream: truncated or damaged";
}

std::optional<std::string> check_zstd(Bytes chunk, std::uint64_t needed) {
  const unsigned long long stated = ZSTD_getFrameContentSize(chunk.data(), chunk.size());
  if (stated == ZSTD_CONTENTSIZE_ERROR) return "is no zstd frame";
  if (stated == ZSTD_CONTENTSIZE_UNKNOWN) return "is a zstd frame that does not state its size";
  if (auto problem = claims(stated, needed)) return problem;
  const std::size_t end = ZSTD_findFrameCompressedSize(chunk.data(), chunk.size());
  if (ZSTD_isError(end) != 0) return "is a zstd frame that is truncated or damaged";
  return ends_at(end, chunk.size());
}

/// The compressor of a dataset, one that is known here, and what it is to unpack to; what HDF5 does itself
/// before it (shuffle) or after it (Fletcher32) is known to keep lengths, or to add four bytes.
struct Packer {
  H5Z_filter_t filter = H5Z_FILTER_NONE;
  std::size_t place = 0;
  std::uint64_t needed = 0, after = 0;
  BitshuffleParameters parameters;
};

bool can_be_checked(H5Z_filter_t filter) {
  constexpr std::array<H5Z_filter_t, 6> all{bzip2, lzf, blosc, lz4, bitshuffle, zstd_filter_number};
  return std::find(all.begin(), all.end(), filter) != all.end();
}

BitshuffleParameters bitshuffle_parameters(const Dataset& d, std::size_t place) {
  const Handle creation(H5Dget_create_plist(d.id.id()), H5Pclose);
  std::array<unsigned, 8> values{};
  std::size_t count = values.size();
  unsigned flags = 0;
  if (H5Pget_filter2(creation.id(), static_cast<unsigned>(place), &flags, &count, values.data(), 0, nullptr,
                     nullptr) < 0)
    return {};
  // Two numbers of the version, the element's bytes, a block's elements, the compression.
  return {values[2], count > 4 ? values[4] : 0};
}

std::optional<Packer> packer_of(const Dataset& d) {
  const auto at = std::find_if(d.filters.begin(), d.filters.end(), can_be_checked);
  if (d.layout != H5D_CHUNKED || at == d.filters.end()) return std::nullopt;
  Packer packer;
  packer.filter = *at;
  packer.place = static_cast<std::size_t>(at - d.filters.begin());
  packer.needed = d.element_bytes;
  for (const std::uint64_t n : d.chunk) packer.needed = saturating_product(packer.needed, n);
  for (auto f = d.filters.begin(); f != d.filters.end(); ++f)
    if (*f == H5Z_FILTER_FLETCHER32) (f < at ? packer.needed : packer.after) += fletcher32_bytes;
  if (packer.filter == bitshuffle) packer.parameters = bitshuffle_parameters(d, packer.place);
  return packer;
}

std::optional<std::string> check_chunk(Bytes chunk, std::uint32_t left_out, const Packer& packer) {
  if (chunk.size() < packer.after) return too_short;
  const Bytes content = chunk.first(chunk.size() - packer.after);
  if ((left_out >> packer.place & 1) != 0) return ends_at(packer.needed, content.size());
  switch (packer.filter) {
    case bzip2:
      return check_bzip2(content);
    case lzf:
      return check_lzf(content, packer.needed);
    case blosc:
      return check_blosc(content, packer.needed);
    case lz4:
      return check_lz4(content, packer.needed);
    case bitshuffle:
      return check_bitshuffle(content, packer.needed, packer.parameters);
    default:
      return check_zstd(content, packer.needed);
  }
}

/// Without a packer only whether the chunk was ever written.
std::optional<std::string> fetch_and_check(const Dataset& d, const std::optional<Packer>& packer,
                                           const std::vector<hsize_t>& at,
                                           std::vector<std::uint8_t>& stored) {
  hsize_t bytes = 0;
  if (H5Dget_chunk_storage_size(d.id.id(), at.data(), &bytes) < 0) {
    H5Eclear2(H5E_DEFAULT);
    bytes = 0;
  }
  if (bytes == 0 && d.may_be_sparse) return std::nullopt;
  if (bytes == 0) return "was never written: incomplete, HDF5 would read fill values there";
  if (!packer) return std::nullopt;
  // No compressor here makes a chunk longer than by its headers and one byte in 16.
  constexpr std::uint64_t headers = 1 << 12;
  if (bytes > packer->needed + packer->needed / 16 + headers)
    return fmt::format("is {} bytes long, its shape needs {}", bytes, packer->needed);
  stored.resize(bytes);
  std::uint32_t left_out = 0;
  if (H5Dread_chunk(d.id.id(), H5P_DEFAULT, at.data(), &left_out, stored.data()) < 0)
    return fmt::format("cannot be read (HDF5: {})", reason());
  return check_chunk(stored, left_out, *packer);
}

std::string named(const Dataset& d, std::size_t place) {
  const H5Z_filter_t number = d.filters[place];
  const auto* const it =
      std::find_if(known.begin(), known.end(), [&](const Known& k) { return k.number == number; });
  if (it != known.end()) return fmt::format("{} ({})", it->name, number);
  const Handle creation(H5Dget_create_plist(d.id.id()), H5Pclose);
  std::array<char, 64> text{};
  std::size_t count = 0;
  unsigned flags = 0;
  H5Pget_filter2(creation.id(), static_cast<unsigned>(place), &flags, &count, nullptr, text.size() - 1,
                 text.data(), nullptr);
  std::string name(text.data());
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return name.empty() ? fmt::format("number {}", number) : fmt::format("'{}' ({})", name, number);
}

}  // namespace

std::optional<std::string> check_filters_present(const Dataset& d) {
  register_zstd_filter();
  for (std::size_t place = 0; place < d.filters.size(); ++place) {
    const H5Z_filter_t number = d.filters[place];
    if (H5Zfilter_avail(number) > 0) continue;
    H5Eclear2(H5E_DEFAULT);
    const auto* const it =
        std::find_if(known.begin(), known.end(), [&](const Known& k) { return k.number == number; });
    const bool packaged = it != known.end() && *it->package != '\0';
    return fmt::format(
        "went through the filter {}, which is not installed; {}", named(d, place),
        packaged ? fmt::format("install Debian's package {} (apt-get install {})", it->package, it->package)
                 : "install a plugin of it and name its folder in HDF5_PLUGIN_PATH; Python's hdf5plugin "
                   "brings many, "
                   "in the folder that python3 -c 'import hdf5plugin; print(hdf5plugin.PLUGIN_PATH)' prints");
  }
  return std::nullopt;
}

std::optional<std::string> check_chunks(const Dataset& d, hid_t selection) {
  const auto packer = packer_of(d);
  const bool holes = d.missing_chunks > 0 && !d.may_be_sparse;
  if ((!packer && !holes) || H5Sget_select_npoints(selection) <= 0) return std::nullopt;
  const std::size_t rank = d.chunk.size();
  std::vector<hsize_t> low(rank), high(rank);
  if (rank != d.shape.size() || H5Sget_select_bounds(selection, low.data(), high.data()) < 0)
    return fmt::format("a selection of it has no bounds (HDF5: {})", reason());
  for (std::size_t a = 0; a < rank; ++a) {
    if (d.chunk[a] == 0) return "has chunks without a size";
    low[a] -= low[a] % d.chunk[a];
  }
  std::vector<std::uint8_t> stored;
  std::vector<hsize_t> at = low;
  for (;;) {
    if (auto problem = fetch_and_check(d, packer, at, stored))
      return fmt::format("chunk at [{}] {}", fmt::join(at, ", "), *problem);
    std::size_t axis = rank;
    for (; axis-- > 0;) {
      at[axis] += d.chunk[axis];
      if (at[axis] <= high[axis]) break;
      at[axis] = low[axis];
    }
    if (axis >= rank) return std::nullopt;  // wrapped below the first axis
  }
}

}  // namespace vdvr::io::hdf5
