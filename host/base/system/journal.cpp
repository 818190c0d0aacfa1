// Journal files: 8 bytes of magic, then records {uint32 crc, uint64 length, payload}, the first of which is
// the head as JSON. Each crc continues the one before, so a record counts only behind those it was written
// behind.
#include "vdvr/expert/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>

#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {
namespace {

constexpr std::array<char, 8> magic{'v', 'd', 'v', 'r', '-', 'j', 'n', '1'};
constexpr std::size_t prefix_bytes = sizeof(std::uint32_t) + sizeof(std::uint64_t);
// A power failure may cost this much work; syncing every record would cost short builds more than that.
constexpr std::int64_t sync_every_ns = 1'000'000'000;

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::uint32_t checksum(std::uint32_t before, std::uint64_t length, std::span<const std::byte> payload) {
  uLong crc = crc32_z(before, reinterpret_cast<const Bytef*>(&length), sizeof length);
  // zlib answers 0 for no bytes at address 0, whatever came before: a run of zeros, which a power failure
  // leaves, would then be whole empty records.
  if (!payload.empty()) crc = crc32_z(crc, reinterpret_cast<const Bytef*>(payload.data()), payload.size());
  return static_cast<std::uint32_t>(crc);
}

std::uint64_t size_of(int file) {
  struct stat s {};
  return ::fstat(file, &s) == 0 ? static_cast<std::uint64_t>(s.st_size) : 0;
}

bool read_at(int file, std::uint64_t offset, void* to, std::size_t bytes) {
  auto* next = static_cast<char*>(to);
  while (bytes > 0) {
    const ssize_t n = ::pread(file, next, bytes, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    next += n;
    offset += static_cast<std::uint64_t>(n);
    bytes -= static_cast<std::size_t>(n);
  }
  return true;
}

// 0, or the error of the write that failed.
int write_at(int file, std::uint64_t offset, const void* from, std::size_t bytes) {
  const auto* next = static_cast<const char*>(from);
  while (bytes > 0) {
    const ssize_t n = ::pwrite(file, next, bytes, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    next += n;
    offset += static_cast<std::uint64_t>(n);
    bytes -= static_cast<std::size_t>(n);
  }
  return 0;
}

void sync_folder(const std::filesystem::path& path) {
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

std::vector<std::byte> bytes_of(const JournalHead& head) {
  const std::string text = nlohmann::json(head).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

std::optional<JournalHead> head_of(const std::vector<std::byte>& bytes) {
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  const auto json = nlohmann::json::parse(text, text + bytes.size(), nullptr, false);
  if (!json.is_object()) return std::nullopt;
  JournalHead head;
  for (const auto& [name, value] : json.items()) {
    if (!value.is_string()) return std::nullopt;
    head[name] = value.get<std::string>();
  }
  return head;
}

std::string differences(const JournalHead& was, const JournalHead& is) {
  std::string text;
  const auto value = [](const JournalHead& head, const std::string& name) {
    const auto found = head.find(name);
    return found == head.end() ? std::string("nothing") : found->second;
  };
  JournalHead all = was;
  all.insert(is.begin(), is.end());
  for (const auto& [name, ignored] : all)
    if (value(was, name) != value(is, name))
      text += fmt::format("{}{} was {}, is {}", text.empty() ? "" : "; ", name, value(was, name),
                          value(is, name));
  return text;
}

}  // namespace

Journal::Journal(std::filesystem::path path, bool resume) : path_(std::move(path)), resume_(resume) {
  lock();
  io::note_temporary(path_);  // as long as it holds nothing
  try {
    std::array<char, magic.size()> start{};
    const std::uint64_t bytes = size_of(file_);
    const bool whole = bytes >= start.size() && read_at(file_, 0, start.data(), start.size());
    if (whole && start != magic)
      throw InputError(fmt::format("{}: is no journal of this version; remove it, or choose another output",
                                   path_.string()));
    if (!whole) return;  // empty, or torn in its first bytes
    end_ = magic.size();
    if (const auto first = read_record()) head_ = head_of(*first);
    records_ = head_ && size_of(file_) > end_ ? 1 : 0;  // at least: enough to know that it is worth keeping
    if (records_ > 0) io::forget_temporary(path_);
  } catch (...) {
    io::forget_temporary(path_);
    ::close(file_);
    throw;
  }
}

Journal::~Journal() {
  if (file_ < 0) return;
  std::error_code ignored;
  if (records_ == 0) std::filesystem::remove(path_, ignored);
  io::forget_temporary(path_);
  ::close(file_);
}

// Locks the file that bears the name once it is locked: its last owner may have removed it meanwhile.
void Journal::lock() {
  for (;;) {
    file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (file_ < 0)
      throw FileError(
          fmt::format("{}: the journal cannot be opened: {}", path_.string(), std::strerror(errno)));
    // A file system without locks still keeps a journal.
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      ::close(file_);
      file_ = -1;
      throw InputError(
          fmt::format("{}: another process is working on this output; wait for it, or choose "
                      "another output",
                      path_.string()));
    }
    struct stat mine {
    }, named{};
    if (::fstat(file_, &mine) == 0 && ::stat(path_.c_str(), &named) == 0 && mine.st_ino == named.st_ino &&
        mine.st_dev == named.st_dev)
      return;
    ::close(file_);
    file_ = -1;
  }
}

void Journal::begin(const JournalHead& head) {
  if (begun_) throw InputError(fmt::format("{}: a journal serves one build", path_.string()));
  if (resumes()) {
    if (*head_ != head)
      throw InputError(
          fmt::format("{}: belongs to another build ({}); start again without `resume`, which "
                      "replaces it, or with the same input and options",
                      path_.string(), differences(*head_, head)));
    begun_ = reading_ = true;
    records_ = 0;
    return;
  }
  begun_ = true;
  records_ = 0;
  chain_ = 0;
  end_ = 0;
  if (::ftruncate(file_, 0) != 0)
    throw ResourceError(fmt::format("{}: cannot be emptied: {}", path_.string(), std::strerror(errno)));
  io::note_temporary(path_);
  if (const int error = write_at(file_, 0, magic.data(), magic.size()); error != 0)
    throw ResourceError(fmt::format("{}: cannot be written: {}", path_.string(), std::strerror(error)));
  end_ = magic.size();
  write_record(bytes_of(head));
  head_ = head;
  sync_folder(path_);
  synced_at_ns_ = now_ns();
}

std::optional<std::vector<std::byte>> Journal::read_record() {
  std::uint32_t crc = 0;
  std::uint64_t length = 0;
  const std::uint64_t bytes = size_of(file_);
  if (bytes < end_ + prefix_bytes || !read_at(file_, end_, &crc, sizeof crc) ||
      !read_at(file_, end_ + sizeof crc, &length, sizeof length) || length > bytes - end_ - prefix_bytes)
    return std::nullopt;
  std::vector<std::byte> payload(length);
  if (!read_at(file_, end_ + prefix_bytes, payload.data(), payload.size()) ||
      checksum(chain_, length, payload) != crc)
    return std::nullopt;
  end_ += prefix_bytes + length;
  chain_ = crc;
  return payload;
}

std::optional<std::vector<std::byte>> Journal::next() {
  if (!reading_) return std::nullopt;
  const std::uint64_t start = end_;
  auto record = read_record();
  if (record) {
    starts_.push_back(start);
    ++replayed_;
    ++records_;
    return record;
  }
  reading_ = false;
  if (::ftruncate(file_, static_cast<off_t>(end_)) != 0)
    throw ResourceError(
        fmt::format("{}: its torn end cannot be cut off: {}", path_.string(), std::strerror(errno)));
  return std::nullopt;
}

std::vector<std::byte> Journal::at(std::size_t number) const {
  const std::uint64_t start = starts_.at(number), bytes = size_of(file_);
  std::uint64_t length = 0;
  if (start + prefix_bytes <= bytes &&
      read_at(file_, start + sizeof(std::uint32_t), &length, sizeof length) &&
      length <= bytes - start - prefix_bytes) {
    std::vector<std::byte> payload(length);
    if (read_at(file_, start + prefix_bytes, payload.data(), payload.size())) return payload;
  }
  throw FileError(fmt::format("{}: record {} cannot be read again", path_.string(), number));
}

void Journal::write_record(const std::vector<std::byte>& record) {
  const auto length = static_cast<std::uint64_t>(record.size());
  const std::uint32_t crc = checksum(chain_, length, record);
  std::array<std::byte, prefix_bytes> prefix{};
  std::memcpy(prefix.data(), &crc, sizeof crc);
  std::memcpy(prefix.data() + sizeof crc, &length, sizeof length);
  int error = write_at(file_, end_, prefix.data(), prefix.size());
  if (error == 0) error = write_at(file_, end_ + prefix_bytes, record.data(), record.size());
  if (error != 0) {
    // Whether or not this succeeds: what lies beyond the last whole record is cut off by the next resume.
    [[maybe_unused]] const int cut = ::ftruncate(file_, static_cast<off_t>(end_));
    throw ResourceError(
        fmt::format("{}: {} bytes cannot be added to the journal at {}: {}; free some space, "
                    "and continue with `resume`",
                    path_.string(), prefix_bytes + record.size(), end_, std::strerror(error)));
  }
  end_ += prefix_bytes + length;
  chain_ = crc;
}

void Journal::append(const std::vector<std::byte>& record) {
  if (!begun_ || reading_)
    throw InputError(fmt::format("{}: the journal still holds what is being added", path_.string()));
  write_record(record);
  if (++records_ == 1) io::forget_temporary(path_);
  const std::int64_t now = now_ns();
  if (now - synced_at_ns_ < sync_every_ns) return;
  sync();
  synced_at_ns_ = now_ns();
}

void Journal::sync() {
  if (::fdatasync(file_) != 0 && (errno == ENOSPC || errno == EDQUOT || errno == EIO))
    throw ResourceError(
        fmt::format("{}: the journal cannot be flushed: {}", path_.string(), std::strerror(errno)));
}

void Journal::remove() {
  if (file_ < 0) return;
  io::forget_temporary(path_);
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  ::close(file_);
  file_ = -1;
}

}  // namespace vdvr
