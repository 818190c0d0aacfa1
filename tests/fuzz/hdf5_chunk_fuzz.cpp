// A stored chunk of a certified volume behind a true checksum, which mutants of whole files never have. The
// first byte says how it is packed, the rest is what lies under the checksum.
#include <zlib.h>

#include "host/files/hdf5/hdf5_chunks.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"

namespace vdvr::fuzz {
namespace {

constexpr std::size_t chunk_bytes = 4096, element_bytes = 4;

std::vector<std::string> seeds(const std::filesystem::path&) {
  std::string content(chunk_bytes, '\0');
  for (std::size_t i = 0; i < chunk_bytes; ++i) content[i] = static_cast<char>(i * i / 97 % 256);
  std::vector<std::string> all{'\0' + content};
  for (const int level : {0, 1, 9}) {
    uLongf size = ::compressBound(chunk_bytes);
    std::string stream(size, '\0');
    ::compress2(reinterpret_cast<Bytef*>(stream.data()), &size,
                reinterpret_cast<const Bytef*>(content.data()), chunk_bytes, level);
    stream.resize(size);
    all.push_back('\1' + stream);
    all.push_back('\3' + stream);
  }
  return all;
}

void read(const std::filesystem::path& file) {
  const std::string bytes = support::bytes_of(file);
  if (bytes.empty()) throw FileError(file.string() + ": is empty");
  std::vector<std::uint8_t> stored(bytes.begin() + 1, bytes.end());
  const std::uint32_t sum = io::hdf5::fletcher32(stored);
  for (int i = 0; i < 4; ++i) stored.push_back(static_cast<std::uint8_t>(sum >> 8 * i));
  std::vector<std::uint8_t> chunk(chunk_bytes);
  const io::hdf5::Packing packing{(bytes[0] & 1) != 0, (bytes[0] & 2) != 0};
  if (const auto problem = io::hdf5::unpack_chunk(stored, packing, element_bytes, chunk))
    throw FileError(file.string() + ": the chunk " + *problem);
}

}  // namespace

const Target fuzz_target{"chunk.bin", Contents::binary, seeds, read};

}  // namespace vdvr::fuzz
