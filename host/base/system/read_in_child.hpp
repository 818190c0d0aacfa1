// Reading damaged HDF5 at arm's length. Metadata without checksums (every file of HDF5's default layout) can
// make the library itself crash, loop or ask for gigabytes; no check of ours comes before its own parsing. So
// a child process reads first, and takes the fall.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

namespace vdvr::io {

/// Runs `work`, a whole reading of `path` that keeps nothing, in a forked child with a limit on its memory
/// (`max_memory_bytes`, 0: the machine's) and its processor time. Returns when the child ended well; throws
/// what the child threw (FileError, ResourceError, ...), or FileError when it crashed or did not end. Costs
/// the reading once more, from the page cache the second time. Where no process can be had, returns at once.
void read_in_child(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                   const std::function<void()>& work);

/// Within `work`, once it knows how many bytes it reads in all, in other files too: gives it the time for
/// that. Elsewhere nothing.
void extend_child(std::uint64_t bytes);

/// True unless the file starts with a superblock of version 2 or later, as a .vdvr of ours does: from then on
/// HDF5 checks its metadata by checksums.
bool metadata_unchecked(const std::filesystem::path& path);

}  // namespace vdvr::io
