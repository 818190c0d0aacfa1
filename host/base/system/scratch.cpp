// Scratch files: unlinked as soon as they are open, mapped shared, their pages let go when too many are
// resident. See scratch.hpp.
#include "vdvr/expert/scratch.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

// How often residence is looked at: a core that only faults pages in adds some ten megabytes meanwhile.
constexpr std::chrono::milliseconds between_looks{4};

std::string mebi(std::uint64_t bytes) {
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / 0x1p20);
}

// A descriptor that closes itself.
class File {
 public:
  explicit File(int fd) : fd_(fd) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

// Pages of a file in memory are what scratch is to save.
bool lies_in_memory(int fd) {
  constexpr long tmpfs = 0x01021994, ramfs = static_cast<long>(0x858458f6);  // linux/magic.h
  struct statfs about {};
  return ::fstatfs(fd, &about) == 0 && (about.f_type == tmpfs || about.f_type == ramfs);
}

std::uint64_t free_bytes(int fd) {
  struct statvfs about {};
  return ::fstatvfs(fd, &about) == 0 ? std::uint64_t{about.f_bavail} * about.f_frsize : 0;
}

[[noreturn]] void refuse(const fs::path& folder, const std::string& what, const std::string& why) {
  throw ResourceError(fmt::format(
      "{}: no scratch file for {}: {}; give `scratch` a folder on a disk with room, or raise `max_memory`",
      folder.string(), what, why));
}

// Of all the room at once: a disk that fills up later would kill the process where it writes into a page.
void reserve(int fd, std::uint64_t bytes, const fs::path& folder, const std::string& what) {
  const std::uint64_t left = free_bytes(fd);
  const auto too_small = [&] {
    refuse(folder, what, fmt::format("it takes {}, {} are free", mebi(bytes), mebi(left)));
  };
  if (left < bytes) too_small();  // rather than fill the disk before it says so
  if (::fallocate(fd, 0, 0, static_cast<off_t>(bytes)) == 0) return;
  const int why = errno;
  const bool unknown = why == EOPNOTSUPP || why == ENOSYS;
  if (why == ENOSPC || why == EDQUOT) too_small();
  if (!unknown || ::ftruncate(fd, static_cast<off_t>(bytes)) != 0)
    refuse(folder, what, std::strerror(unknown ? errno : why));
}

std::uint64_t page_bytes() { return static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)); }

// A number of pages from /proc/self/statm: the third is of what lies in files.
std::uint64_t resident_file_bytes(int statm) {
  std::array<char, 128> text{};
  const ssize_t n = ::pread(statm, text.data(), text.size() - 1, 0);
  if (n <= 0) return 0;
  std::uint64_t pages = 0;
  const char *at = text.data(), *end = text.data() + n;
  for (int field = 0; field < 3; ++field) {
    const auto [rest, code] = std::from_chars(at, end, pages);
    if (code != std::errc()) return 0;
    at = rest + 1;
  }
  return pages * page_bytes();
}

}  // namespace

class Scratch::Keeper {
 public:
  Keeper(fs::path folder, std::uint64_t resident) : folder_(std::move(folder)), resident_(resident) {}
  ~Keeper() {
    {
      const std::lock_guard guard(lock_);
      ends_ = true;
    }
    wake_.notify_all();
    if (thread_.joinable()) thread_.join();
  }
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;

  void* map(std::uint64_t bytes, const std::string& what) {
    if (bytes == 0) return nullptr;
    std::string name = (folder_ / ".vdvr-scratch.XXXXXX").string();
    const File file(::mkostemp(name.data(), O_CLOEXEC));
    if (file.fd() < 0) refuse(folder_, what, std::strerror(errno));
    ::unlink(name.c_str());
    if (lies_in_memory(file.fd())) refuse(folder_, what, "the folder lies in memory itself (tmpfs)");
    reserve(file.fd(), bytes, folder_, what);
    void* at = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.fd(), 0);
    if (at == MAP_FAILED) refuse(folder_, what, std::strerror(errno));
    const std::lock_guard guard(lock_);
    mapped_[at] = bytes;
    sum_ += bytes;
    peak_ = std::max(peak_, sum_);
    if (!thread_.joinable()) thread_ = std::thread([this] { keep(); });
    wake_.notify_all();
    return at;
  }

  void unmap(const void* at) noexcept {
    const std::lock_guard guard(lock_);
    const auto found = mapped_.find(const_cast<void*>(at));  // NOLINT: a key, nothing is written
    if (found == mapped_.end()) return;
    ::munmap(found->first, found->second);
    sum_ -= found->second;
    mapped_.erase(found);
  }

  [[nodiscard]] std::uint64_t resident() const { return resident_; }
  [[nodiscard]] std::uint64_t peak() const {
    const std::lock_guard guard(lock_);
    return peak_;
  }

 private:
  void keep() {
    const File statm(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
    std::unique_lock guard(lock_);
    std::uint64_t others = resident_file_bytes(statm.fd());  // programs and libraries
    while (!ends_) {
      if (mapped_.empty()) {
        wake_.wait(guard);
        continue;
      }
      wake_.wait_for(guard, between_looks);
      const std::uint64_t now = resident_file_bytes(statm.fd());
      if (now <= others + resident_) {
        others = std::min(others, now);
        continue;
      }
      // A shared page keeps what was written into it: only this process's view of it goes.
      for (const auto& [at, bytes] : mapped_) ::madvise(at, bytes, MADV_DONTNEED);
      others = resident_file_bytes(statm.fd());
    }
  }

  fs::path folder_;
  std::uint64_t resident_;
  mutable std::mutex lock_;
  std::condition_variable wake_;
  std::map<void*, std::uint64_t> mapped_;
  std::uint64_t sum_ = 0, peak_ = 0;
  bool ends_ = false;
  std::thread thread_;
};

Scratch::Scratch(fs::path folder, std::uint64_t resident_bytes)
    : keeper_(std::make_unique<Keeper>(std::move(folder), resident_bytes)) {}
Scratch::~Scratch() = default;

void* Scratch::map_bytes(std::uint64_t bytes, const std::string& what) { return keeper_->map(bytes, what); }
void Scratch::unmap(const void* first) noexcept { keeper_->unmap(first); }
std::uint64_t Scratch::resident_bytes() const { return keeper_->resident(); }
std::uint64_t Scratch::peak_bytes() const { return keeper_->peak(); }

fs::path default_scratch_folder() {
  const char* named = std::getenv("TMPDIR");  // NOLINT(concurrency-mt-unsafe): nobody writes it
  return named != nullptr && *named != '\0' ? fs::path(named) : fs::path("/var/tmp");
}

std::shared_ptr<Scratch> scratch_for(std::uint64_t bytes, std::uint64_t max_memory_bytes,
                                     const fs::path& folder) {
  const std::uint64_t share = max_memory_bytes / 8;
  if (max_memory_bytes == 0 || bytes <= share) return nullptr;
  return std::make_shared<Scratch>(folder.empty() ? default_scratch_folder() : folder, share);
}

std::shared_ptr<Scratch> scratch_for_scan(std::int64_t views, std::int64_t rows, std::int64_t columns,
                                          std::uint64_t max_memory_bytes, const fs::path& folder) {
  const auto samples = static_cast<std::uint64_t>(std::max(views, 2 * columns) * rows * columns);
  return scratch_for(samples * sizeof(float), max_memory_bytes, folder);
}

namespace {

std::optional<std::uint64_t> number_in(const fs::path& file) {
  std::ifstream in(file);
  std::uint64_t value = 0;
  if (in >> value) return value;
  return std::nullopt;  // absent, or "max"
}

std::optional<std::uint64_t> available_of_system() {
  std::ifstream in("/proc/meminfo");
  for (std::string name; in >> name;) {
    std::uint64_t kibi = 0;
    if (name == "MemAvailable:" && in >> kibi) return kibi * 1024;
    std::getline(in, name);
  }
  return std::nullopt;
}

// Version 2 of control groups, as containers see their own: the page cache in it gives way.
std::optional<std::uint64_t> available_of_group() {
  const fs::path group = "/sys/fs/cgroup";
  const auto most = number_in(group / "memory.max"), used = number_in(group / "memory.current");
  if (!most || !used) return std::nullopt;
  std::uint64_t cache = 0, value = 0;
  std::ifstream stat(group / "memory.stat");
  for (std::string name; stat >> name >> value;)
    if (name == "file") cache = value;
  const std::uint64_t held = *used - std::min(*used, cache);
  return *most - std::min(*most, held);
}

}  // namespace

std::uint64_t half_of_free_memory() {
  const auto system = available_of_system(), group = available_of_group();
  if (!system) return group.value_or(0) / 2;
  return std::min(*system, group.value_or(*system)) / 2;
}

}  // namespace vdvr
