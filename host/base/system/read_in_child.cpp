// Reading in a child process; see read_in_child.hpp. The child answers by one letter, which says how the
// reading or a block of it ended, and a message where it failed. After that it ends.
#include "host/base/system/read_in_child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <string>
#include <utility>

#include "host/base/system/limits.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::io {
namespace {

constexpr char done = 'd', no_memory = 'm', foreign = 'x';
constexpr char letter_of(ErrorKind kind) { return static_cast<char>('0' + static_cast<int>(kind)); }

// Reading at a hundredth of a disk's speed still ends in time; a loop in the library does not.
constexpr std::uint64_t least_cpu_s = 4, slowest_bytes_per_s = 1u << 20;

#if !defined(__SANITIZE_ADDRESS__)  // its shadow alone is terabytes of address space
std::uint64_t page_bytes() { return static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)); }

std::uint64_t address_space_bytes() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * page_bytes();
}

// What HDF5 and the C library take beside the samples.
constexpr std::uint64_t aside_bytes = 256u << 20;

void limit_memory(std::uint64_t max_memory_bytes) {
  const std::uint64_t now = address_space_bytes();
  const auto physical = physical_memory();
  const std::uint64_t more = max_memory_bytes == 0 ? physical : max_memory_bytes;
  if (now == 0) return;
  const rlimit memory{now + more + aside_bytes, RLIM_INFINITY};
  ::setrlimit(RLIMIT_AS, &memory);
}
#else
void limit_memory(std::uint64_t) {}
#endif

/// SIGXCPU ends a process at the first of its two limits, which the process may raise up to the second.
void limit_time(std::uint64_t bytes, std::uint64_t used_s = 0) {
  const rlimit cpu{used_s + least_cpu_s + bytes / slowest_bytes_per_s, RLIM_INFINITY};
  ::setrlimit(RLIMIT_CPU, &cpu);
}

void set_limits(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  std::error_code error;
  const std::uint64_t file_bytes = std::filesystem::is_regular_file(path, error)
                                       ? static_cast<std::uint64_t>(std::filesystem::file_size(path, error))
                                       : std::uint64_t{1} << 36;
  limit_time(error ? 0 : file_bytes);
  limit_memory(max_memory_bytes);
}

void tell(int to, char how, const std::string& message) {
  const std::string all = how + message;
  for (std::size_t at = 0; at < all.size();) {
    const ssize_t n = ::write(to, all.data() + at, all.size() - at);
    if (n <= 0) return;
    at += static_cast<std::size_t>(n);
  }
}

// True: the work is done, and the parent knows.
bool play(int to, const std::function<void()>& work) {
  try {
    work();
    tell(to, done, "");
    return true;
  } catch (const Error& e) {
    tell(to, letter_of(e.kind()), e.what());
  } catch (const std::bad_alloc&) {
    tell(to, no_memory, "");
  } catch (const std::exception& e) {
    tell(to, foreign, e.what());
  }
  return false;
}

std::string hear(int from) {
  std::string all;
  std::array<char, 4096> block;
  for (;;) {
    const ssize_t n = ::read(from, block.data(), block.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return all;
    all.append(block.data(), static_cast<std::size_t>(n));
  }
}

[[noreturn]] void throw_again(const std::string& path, char how, const std::string& message) {
  if (how == letter_of(ErrorKind::mismatch)) throw MismatchError(message);
  if (how == letter_of(ErrorKind::input) || how == letter_of(ErrorKind::file)) throw FileError(message);
  if (how == letter_of(ErrorKind::resource)) throw ResourceError(message);
  switch (how) {
    case no_memory:
      throw ResourceError(path + ": not enough memory to read it within the limit; raise `max_memory`");
    default:
      throw FileError(fmt::format("{}: cannot be read: {}", path, message));
  }
}

// The child ended without an answer.
[[noreturn]] void judge_end(const std::string& path, int status) {
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGINT || signal == SIGTERM) throw Interrupted(signal);  // it was meant for us as well
  const std::string remedy =
      "; it is damaged. `h5dump` shows what is left of it; take another copy of the file";
  if (signal == SIGXCPU || signal == SIGKILL)
    throw FileError(
        fmt::format("{}: reading it with the HDF5 library does not come to an end{}", path, remedy));
  throw FileError(fmt::format("{}: the HDF5 library crashes reading it ({}){}", path,
                              signal != 0 ? ::strsignal(signal) : "without a signal", remedy));
}

// How a child ends whose answer is read to its end.
int reap(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

void become_child(pid_t parent, const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(0);
  for (const int signal : {SIGINT, SIGTERM, SIGXCPU}) std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  set_limits(path, max_memory_bytes);
}

std::uint64_t used_seconds() {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  return static_cast<std::uint64_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 1;
}

// Whole or nothing: false where the other end has gone.
bool send_block(int socket, const FrameBlock& block) {
  ssize_t n = 0;
  while ((n = ::send(socket, &block, sizeof(block), MSG_NOSIGNAL)) < 0 && errno == EINTR) {
  }
  return n == static_cast<ssize_t>(sizeof(block));
}

bool receive(int socket, void* to, std::size_t bytes) {
  ssize_t n = 0;
  while ((n = ::recv(socket, to, bytes, MSG_WAITALL)) < 0 && errno == EINTR) {
  }
  return n == static_cast<ssize_t>(bytes);
}

}  // namespace

bool metadata_unchecked(const std::filesystem::path& path) {
  std::array<char, 9> start{};
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), start.size());
  return !file || std::string(start.data(), 8) != "\x89HDF\r\n\x1a\n" || start[8] < 2;
}

void read_in_child(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                   const std::function<void()>& work) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    return;
  }
  if (child == 0) {
    become_child(parent, path, max_memory_bytes);
    play(ends[1], work);
    ::_exit(0);
  }
  ::close(ends[1]);
  const std::string answer = hear(ends[0]);
  ::close(ends[0]);
  const int status = reap(child);
  if (answer.empty()) judge_end(path.string(), status);
  if (answer[0] != done) throw_again(path.string(), answer[0], answer.substr(1));
}

FrameReader::FrameReader(std::filesystem::path path, std::uint64_t max_memory_bytes, std::uint64_t all_bytes,
                         std::uint64_t frame_numbers, std::uint64_t shared_bytes, Read read)
    : path_(std::move(path)),
      max_memory_bytes_(max_memory_bytes),
      all_bytes_(all_bytes),
      frame_numbers_(frame_numbers),
      most_frames_(static_cast<std::int64_t>(
          std::max<std::uint64_t>(1, shared_bytes / (sizeof(double) * frame_numbers)))),
      read_(std::move(read)) {
  const std::size_t numbers = static_cast<std::size_t>(most_frames_) * frame_numbers_;
  void* memory = ::mmap(nullptr, numbers * sizeof(double), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) return;
  shared_ = {static_cast<double*>(memory), numbers};
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return;
  const pid_t parent = ::getpid();
  child_ = ::fork();
  if (child_ == 0) {
    ::close(ends[0]);
    become_child(parent, path_, max_memory_bytes_);
    serve(ends[1]);
  }
  ::close(ends[1]);
  socket_ = ends[0];
}

FrameReader::~FrameReader() {
  if (child_ > 0) ::kill(child_, SIGKILL);
  end();
  if (!shared_.empty()) ::munmap(shared_.data(), shared_.size_bytes());
}

// The child, once and for all.
void FrameReader::end() noexcept {
  if (socket_ >= 0) ::close(socket_);
  if (child_ > 0) reap(child_);
  socket_ = child_ = -1;
}

void FrameReader::serve(int socket) {
  FrameBlock block;
  while (receive(socket, &block, sizeof(block))) {
    limit_time(all_bytes_, used_seconds());
    if (!play(socket, [&] { read_(block, shared_.data()); })) break;
  }
  ::_exit(0);
}

void FrameReader::read(FrameBlock block, double* out) {
  const std::lock_guard guard(lock_);
  if (failure_) std::rethrow_exception(failure_);
  if (child_ <= 0) return read_(block, out);
  const std::int64_t last = block.first + block.frames;
  for (; block.first < last; block.first += block.frames) {
    block.frames = std::min(most_frames_, last - block.first);
    try {
      read_shared(block);
    } catch (...) {
      failure_ = std::current_exception();
      throw;
    }
    out = std::copy_n(shared_.data(), static_cast<std::uint64_t>(block.frames) * frame_numbers_, out);
  }
}

void FrameReader::read_shared(const FrameBlock& block) {
  char how = 0;
  if (send_block(socket_, block) && receive(socket_, &how, 1)) {
    if (how == done) return;
    const std::string message = hear(socket_);
    end();
    throw_again(path_.string(), how, message);
  }
  const int status = reap(std::exchange(child_, -1));
  end();
  judge_end(path_.string(), status);
}

}  // namespace vdvr::io
