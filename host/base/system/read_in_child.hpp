// Reading damaged HDF5 at arm's length. Metadata without checksums (every file of HDF5's default layout) can
// make the library itself crash, loop or ask for gigabytes; no check of ours comes before its own parsing. So
// a child process reads first, and takes the fall.
#pragma once

#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <mutex>
#include <span>

namespace vdvr::io {

/// Runs `work`, a whole reading of `path` that keeps nothing, in a forked child with a limit on its memory
/// (`max_memory_bytes`, 0: the machine's) and its processor time. Returns when the child ended well; throws
/// what the child threw (FileError, ResourceError, ...), FileError when it crashed or did not end,
/// Interrupted. Costs the reading once more, from the page cache the second time. Where no process can be
/// had, returns at once.
void read_in_child(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                   const std::function<void()>& work);

/// A block of frames: which stack, its first frame, how many.
struct FrameBlock {
  std::int64_t stack = 0, first = 0, frames = 0;
};

/// A child process that reads frames for us from files that are open already, so that decoding them takes
/// nobody else down, and they are read once.
class FrameReader {
 public:
  using Read = std::function<void(const FrameBlock&, double* out)>;

  /// Forks. `read` runs in the child, with the limits of read_in_child and `all_bytes` to read at most for
  /// each block. Blocks of `frame_numbers` numbers a frame come through `shared_bytes` or one frame of memory
  /// that both see. Where no process can be had, read() calls `read`.
  FrameReader(std::filesystem::path path, std::uint64_t max_memory_bytes, std::uint64_t all_bytes,
              std::uint64_t frame_numbers, std::uint64_t shared_bytes, Read read);
  ~FrameReader();
  FrameReader(const FrameReader&) = delete;
  FrameReader& operator=(const FrameReader&) = delete;

  /// Numbers of the block's frames, one after the other. Throws what `read` threw in the child; FileError
  /// when the child crashed or did not end, then and at each later call; Interrupted.
  void read(FrameBlock block, double* out);

 private:
  [[noreturn]] void serve(int socket);
  void read_shared(const FrameBlock& block);
  void end() noexcept;

  std::filesystem::path path_;
  std::uint64_t max_memory_bytes_, all_bytes_, frame_numbers_;
  std::int64_t most_frames_;
  Read read_;
  std::span<double> shared_;
  std::mutex lock_;
  std::exception_ptr failure_;
  int socket_ = -1, child_ = -1;
};

/// True unless the file starts with a superblock of version 2 or later, as a .vdvr of ours does: from then on
/// HDF5 checks its metadata by checksums.
bool metadata_unchecked(const std::filesystem::path& path);

}  // namespace vdvr::io
