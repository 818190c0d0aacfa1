// How a dataset is stored, checked; and its chunks, taken apart here and not by HDF5's filters: HDF5 1.10
// inflates without a limit, and copies what a chunk should hold from behind what it inflated to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "host/files/hdf5/hdf5.hpp"

namespace vdvr::io::hdf5 {

constexpr std::uint64_t fletcher32_bytes = 4;   ///< behind every stored chunk
constexpr std::uint64_t most_inflation = 1032;  ///< a deflate stream spends 2 bits on 258 bytes, never less

/// More than any encoder writes for a chunk that deflate cannot shorten.
constexpr std::uint64_t most_stored(std::uint64_t chunk_bytes) {
  return chunk_bytes + chunk_bytes / 256 + 64 + fletcher32_bytes;
}

/// a b, or the largest number when that does not fit: then no file is long enough and the comparison refuses
/// it.
std::uint64_t saturating_product(std::uint64_t a, std::uint64_t b);

/// Fills in packing and sizes of a dataset that was declared, and checks them: filters, and that the chunks
/// its shape needs are stored in a file of `file_bytes`. Reads no chunk. What is wrong, or nothing.
std::optional<std::string> check_storage(Dataset& dataset, std::uint64_t file_bytes);

/// Of a dataset that HDF5 itself reads, by whatever filters: what it never writes, and allocates or copies
/// by. What is wrong, or nothing.
std::optional<std::string> check_extents(const Dataset& dataset);

/// HDF5's Fletcher32 of any number of bytes.
std::uint32_t fletcher32(std::span<const std::uint8_t> bytes);

/// A chunk's bytes from what is stored: the checksum first, then deflate, then shuffle. Writes all of `chunk`
/// and nothing beyond. What is wrong, or nothing; `chunk` is then as the file says.
std::optional<std::string> unpack_chunk(std::span<const std::uint8_t> stored, const Packing& packing,
                                        std::size_t element_bytes, std::span<std::uint8_t> chunk);

/// Of the chunk at `at`, a multiple of the chunk's extents along each axis, what lies in the dataset, to its
/// place in dataset.bytes bytes; takes dataset.chunk_memory bytes beside them. `stored_bytes` grows by what
/// is read of the file. What is wrong, with the place of the chunk, or nothing.
std::optional<std::string> read_chunk(const Dataset& dataset, const Shape& at, void* values,
                                      std::uint64_t& stored_bytes);

/// The whole dataset into dataset.bytes bytes, chunk by chunk; takes dataset.chunk_memory bytes beside them.
/// What is wrong, with the place of the chunk, or nothing.
std::optional<std::string> read_chunks(const Dataset& dataset, void* values);

}  // namespace vdvr::io::hdf5
