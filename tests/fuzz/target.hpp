// What one reader's fuzz program gives: valid files to start from, and one reading. Each
// tests/fuzz/*_fuzz.cpp defines fuzz_target; one_input.cpp judges a reading, mutate.cpp makes the mutants
// where libFuzzer does not.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vdvr::fuzz {

/// What a reader may take, beyond what the process holds: its --max-memory.
constexpr std::uint64_t memory_limit = 64u << 20;

/// What a file holds, for damage that hits more than single bytes.
enum class Contents { binary, text, hdf5 };

struct Target {
  /// The name under which the bytes are written.
  std::string file_name;
  Contents contents = Contents::binary;
  /// Bytes of small valid files. `folder` is empty and may be used; what is left there lies beside the file.
  std::vector<std::string> (*seeds)(const std::filesystem::path& folder) = nullptr;
  /// Reads the file as a command would; every refusal is a vdvr::Error.
  void (*read)(const std::filesystem::path& file) = nullptr;
};

extern const Target fuzz_target;

enum class Verdict { read, refused, mismatch, beyond_limit, wrong };

/// Writes the bytes into `folder`, reads them, and says how it ended; `why` gets the message of a wrong end:
/// an exception of another kind, or a message that does not name the file.
Verdict judge(const std::filesystem::path& folder, const std::uint8_t* bytes, std::size_t size,
              std::string& why);

}  // namespace vdvr::fuzz
