// The driver without libFuzzer: makes mutants, reads each in a child process, counts how the readings end.
// A crash, a sanitizer's report, more than ten seconds or more memory than allowed is a failure; its file is
// kept. Options: --count N, --seed N, --from N, --keep FOLDER, --write-corpus FOLDER.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "tests/fuzz/mutations.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using namespace vdvr::fuzz;

struct Options {
  std::uint64_t count = 300, seed = 1, from = 0;
  fs::path keep, corpus;
};

// What the child tells, in memory that both see.
struct Shared {
  std::uint64_t index = 0;
  std::array<std::uint64_t, 5> verdicts{};
  double slowest_s = 0;
  long peak_kib = 0;
};

// ASan keeps freed memory aside for a while, and HDF5 its free lists.
constexpr long slack_kib = 256 << 10;
// Of processor time, so that a busy machine fails nothing; the wall clock only ends what waits for ever.
constexpr unsigned limit_s = 10, limit_wall_s = 120;

void set_clock(unsigned cpu_s, unsigned wall_s) {
  const itimerval timer{{0, 0}, {static_cast<time_t>(cpu_s), 0}};
  ::setitimer(ITIMER_PROF, &timer, nullptr);
  ::alarm(wall_s);
}

long peak_kib() {
  rusage own{}, children{};
  ::getrusage(RUSAGE_SELF, &own);
  ::getrusage(RUSAGE_CHILDREN, &children);
  return std::max(own.ru_maxrss, children.ru_maxrss);
}

// Reads mutants until the end or until one goes wrong, which ends the child.
[[noreturn]] void work(const Options& o, const std::vector<std::string>& seeds, const fs::path& folder,
                       Shared& shared, std::uint64_t end) {
  const long allowed = peak_kib() + static_cast<long>(memory_limit >> 10) + slack_kib;
  for (; shared.index < end; ++shared.index) {
    const std::string bytes = mutant(seeds, fuzz_target.contents, o.seed, shared.index);
    std::string why;
    const auto begin = std::chrono::steady_clock::now();
    set_clock(limit_s, limit_wall_s);
    const Verdict v = judge(folder, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), why);
    set_clock(0, 0);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    shared.slowest_s = std::max(shared.slowest_s, took.count());
    shared.peak_kib = std::max(shared.peak_kib, peak_kib());
    ++shared.verdicts[static_cast<std::size_t>(v)];
    if (v == Verdict::wrong) std::fprintf(stderr, "mutant %lu: %s\n", shared.index, why.c_str());
    if (shared.peak_kib > allowed) {
      std::fprintf(stderr, "mutant %lu: %ld KiB of memory, %ld are allowed\n", shared.index, shared.peak_kib,
                   allowed);
      ::_exit(2);
    }
    if (v == Verdict::wrong) ::_exit(2);
  }
  ::_exit(0);
}

void keep(const Options& o, const std::vector<std::string>& seeds, std::uint64_t index) {
  if (o.keep.empty()) return;
  fs::create_directories(o.keep);
  const std::string bytes = mutant(seeds, fuzz_target.contents, o.seed, index);
  const std::string name = std::to_string(o.seed) + "-" + std::to_string(index) + "-" + fuzz_target.file_name;
  std::ofstream(o.keep / name, std::ios::binary) << bytes;
}

std::string ending(int status) {
  if (!WIFSIGNALED(status)) return "ended with " + std::to_string(WEXITSTATUS(status));
  if (WTERMSIG(status) == SIGPROF) return "took more than " + std::to_string(limit_s) + " s";
  if (WTERMSIG(status) == SIGALRM) return "did not come back in " + std::to_string(limit_wall_s) + " s";
  return std::string("was killed by ") + ::strsignal(WTERMSIG(status));
}

int run(const Options& o) {
  const vdvr::support::TemporaryFolder folder;
  const std::vector<std::string> seeds = fuzz_target.seeds(folder.path());
  if (!o.corpus.empty()) {
    fs::create_directories(o.corpus);
    for (std::size_t i = 0; i < seeds.size(); ++i)
      std::ofstream(o.corpus / std::to_string(i), std::ios::binary) << seeds[i];
    return 0;
  }
  for (const std::string& whole : seeds) {
    std::string why;
    if (judge(folder.path(), reinterpret_cast<const std::uint8_t*>(whole.data()), whole.size(), why) !=
        Verdict::read) {
      std::fprintf(stderr, "a valid file is not read: %s\n", why.c_str());
      return 1;
    }
  }
  void* memory = ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return 1;
  Shared& shared = *new (memory) Shared{};
  std::uint64_t failures = 0;
  const std::uint64_t end = o.from + o.count;
  if (o.count == 1) keep(o, seeds, o.from);  // who asks for one wants to see it
  // A fresh process every so often: a leak in one library shows as its own trouble, not as the last mutant's.
  constexpr std::uint64_t batch = 500;
  for (shared.index = o.from; shared.index < end && failures < 100;) {
    const pid_t child = ::fork();
    if (child == 0) work(o, seeds, folder.path(), shared, std::min(end, (shared.index / batch + 1) * batch));
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) continue;
    std::fprintf(stderr, "mutant %lu %s\n", shared.index, ending(status).c_str());
    keep(o, seeds, shared.index);
    ++failures;
    ++shared.index;
    shared.peak_kib = 0;  // of the readings that went well
  }
  const auto count = [&](Verdict v) { return shared.verdicts[static_cast<std::size_t>(v)]; };
  std::printf(
      "%s: %lu mutants: %lu read, %lu refused, %lu mismatched, %lu beyond the memory limit; slowest %.2f s, "
      "peak %ld MiB; %lu failures\n",
      fuzz_target.file_name.c_str(), shared.index - o.from, count(Verdict::read), count(Verdict::refused),
      count(Verdict::mismatch), count(Verdict::beyond_limit), shared.slowest_s, shared.peak_kib >> 10,
      failures);
  return failures == 0 && shared.index == end ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--count") o.count = std::strtoull(argv[i + 1], nullptr, 10);
    else if (name == "--seed") o.seed = std::strtoull(argv[i + 1], nullptr, 10);
    else if (name == "--from") o.from = std::strtoull(argv[i + 1], nullptr, 10);
    else if (name == "--keep") o.keep = argv[i + 1];
    else if (name == "--write-corpus") o.corpus = argv[i + 1];
  }
  return run(o);
}
