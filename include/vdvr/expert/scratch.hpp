// Room on a disk for arrays that do not fit --max-memory: files without a name, which vanish with the
// process however it ends, mapped into its addresses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "vdvr/api.hpp"

namespace vdvr {

/// Threads may share one. While anything is mapped, a thread of its own looks every few milliseconds how much
/// of the files is resident, and lets go of all of it beyond the limit: what is read or written again comes
/// from the system's page cache, or from the disk. So whoever passes over such an array in order needs to do
/// nothing.
class VDVR_API Scratch {
 public:
  /// `folder`: where the files lie; nothing is written before the first map(). `resident_bytes`: of all that
  /// is mapped, up to what a few milliseconds add.
  Scratch(std::filesystem::path folder, std::uint64_t resident_bytes);
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  /// n zeros on the disk, which is asked for all the room at once. Throws ResourceError naming the folder,
  /// `what`, and what is free where it does not suffice or is none of a disk.
  template <class T>
  std::span<T> map(std::size_t n, const std::string& what) {
    return {static_cast<T*>(map_bytes(std::uint64_t{n} * sizeof(T), what)), n};
  }
  /// What map() gave.
  void unmap(const void* first) noexcept;

  [[nodiscard]] std::uint64_t resident_bytes() const;
  /// Of all files at once, the most so far.
  [[nodiscard]] std::uint64_t peak_bytes() const;

 private:
  void* map_bytes(std::uint64_t bytes, const std::string& what);

  class Keeper;
  std::unique_ptr<Keeper> keeper_;
};

/// Where a stage puts arrays that it passes over in order: in memory while they are small, else in scratch.
struct MemoryBudget {
  std::shared_ptr<Scratch> scratch;   ///< none: in memory, whatever their size
  std::uint64_t in_memory_bytes = 0;  ///< what may lie in memory of an array

  [[nodiscard]] std::shared_ptr<Scratch> for_bytes(std::uint64_t bytes) const {
    return bytes <= in_memory_bytes ? nullptr : scratch;
  }
};

/// Where scratch files go when nobody says: TMPDIR, else /var/tmp, which is meant for what /tmp may be too
/// small for.
VDVR_API std::filesystem::path default_scratch_folder();

/// For an array of `bytes` under a limit of memory (0: none): nothing where it takes an eighth of the limit
/// or less, so that it and what is made of it fit beside each other; else scratch in `folder` (empty: the
/// default), of which an eighth of the limit may be resident.
VDVR_API std::shared_ptr<Scratch> scratch_for(std::uint64_t bytes, std::uint64_t max_memory_bytes,
                                              const std::filesystem::path& folder);
/// The same for a scan, and where the volume at its pitch, columns x columns x rows, takes a sixteenth: a
/// build holds four of these as base samples, four as gold that is kept and eight as heights made of that,
/// and kept gold lies where the scan does. A wide detector of few rows has a small scan and a large volume.
VDVR_API std::shared_ptr<Scratch> scratch_for_scan(std::int64_t views, std::int64_t rows,
                                                   std::int64_t columns, std::uint64_t max_memory_bytes,
                                                   const std::filesystem::path& folder);

/// Half of the memory that is free now, as the system and the process's control group say: the default of
/// --max-memory. 0 where neither says.
VDVR_API std::uint64_t half_of_free_memory();

}  // namespace vdvr
