// A reading in a child process; see read_in_child.hpp. The child answers through a pipe: one letter, by
// which it says how it ended, and the message.
#include "host/base/system/read_in_child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <string>

#include "host/base/system/limits.hpp"
#include "vdvr/error.hpp"

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
void limit_time(std::uint64_t bytes) {
  const rlimit cpu{least_cpu_s + bytes / slowest_bytes_per_s, RLIM_INFINITY};
  ::setrlimit(RLIMIT_CPU, &cpu);
}

bool in_child = false;

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

void play(int to, const std::function<void()>& work) {
  try {
    work();
    tell(to, done, "");
  } catch (const Error& e) {
    tell(to, letter_of(e.kind()), e.what());
  } catch (const std::bad_alloc&) {
    tell(to, no_memory, "");
  } catch (const std::exception& e) {
    tell(to, foreign, e.what());
  }
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
void judge_end(const std::string& path, int status) {
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGINT || signal == SIGTERM) return;  // meant for us as well: the next report stops the work
  const std::string remedy =
      "; it is damaged. `h5dump` shows what is left of it; take another copy of the file";
  if (signal == SIGXCPU || signal == SIGKILL)
    throw FileError(
        fmt::format("{}: reading it with the HDF5 library does not come to an end{}", path, remedy));
  throw FileError(fmt::format("{}: the HDF5 library crashes reading it ({}){}", path,
                              signal != 0 ? ::strsignal(signal) : "without a signal", remedy));
}

}  // namespace

bool metadata_unchecked(const std::filesystem::path& path) {
  std::array<char, 9> start{};
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), start.size());
  return !file || std::string(start.data(), 8) != "\x89HDF\r\n\x1a\n" || start[8] < 2;
}

void extend_child(std::uint64_t bytes) {
  rlimit now{};
  if (!in_child || ::getrlimit(RLIMIT_CPU, &now) != 0) return;
  if (least_cpu_s + bytes / slowest_bytes_per_s > now.rlim_cur) limit_time(bytes);
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
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(0);
    for (const int signal : {SIGINT, SIGTERM, SIGXCPU}) std::signal(signal, SIG_DFL);
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    in_child = true;
    set_limits(path, max_memory_bytes);
    play(ends[1], work);
    ::_exit(0);
  }
  ::close(ends[1]);
  const std::string answer = hear(ends[0]);
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (answer.empty()) return judge_end(path.string(), status);
  if (answer[0] != done) throw_again(path.string(), answer[0], answer.substr(1));
}

}  // namespace vdvr::io
