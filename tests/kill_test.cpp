// Kills `vdvr build` and `vdvr run` at random moments: --resume always ends in the same content, nothing
// half-written is ever taken for a result, and nothing is left behind.
#define BOOST_TEST_MODULE kill
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "tests/support/temporary_folder.hpp"
#include "vdvr/vdvr_file.hpp"

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

/// Starts the program with its messages in a file; its process.
pid_t start(const std::vector<std::string>& words, const fs::path& messages) {
  std::vector<std::string> all{VDVR_BINARY};
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> argv;
  std::transform(all.begin(), all.end(), std::back_inserter(argv), [](std::string& s) { return s.data(); });
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    const int file = ::open(messages.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  return child;
}

int finish(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

struct Work {
  vdvr::support::TemporaryFolder folder;
  fs::path scan = folder / "scan.h5", messages = folder / "messages", out = folder / "out";
  std::string hash;
  std::chrono::duration<double> whole{};

  Work() {
    fs::create_directory(out);
    BOOST_REQUIRE(run({"simulate", "--phantom", "shepp-logan", "--detector", "25x13", "--pitch", "5.5",
                       "--angles", "24", "-o", scan.string()}) == 0);
  }
  int run(const std::vector<std::string>& words) const { return finish(start(words, messages)); }
  [[nodiscard]] std::string said() const { return vdvr::support::bytes_of(messages); }
  [[nodiscard]] std::vector<std::string> build(const std::string& more = "") const {
    // Little memory makes small blocks, hence many records.
    std::vector<std::string> words{"build", scan.string(),   "--epsilon", "15%", "--max-memory",
                                   "40M",   "--granularity", "2",         "-o",  volume().string()};
    if (!more.empty()) words.push_back(more);
    return words;
  }
  [[nodiscard]] fs::path volume() const { return out / "o.vdvr"; }
  [[nodiscard]] fs::path journal() const { return out / "o.vdvr.journal"; }

  // An uninterrupted build, and how long it takes.
  void build_whole() {
    const auto begin = Clock::now();
    BOOST_REQUIRE_MESSAGE(run(build()) == 0, said());
    whole = Clock::now() - begin;
    hash = vdvr::content_sha256(vdvr::read_vdvr(volume()).volume);
    BOOST_TEST(!fs::exists(journal()));
    fs::remove(volume());
  }

  void only_these_remain(const std::vector<fs::path>& wanted) const {
    for (const auto& entry : fs::directory_iterator(out))
      BOOST_TEST((std::find(wanted.begin(), wanted.end(), entry.path()) != wanted.end()),
                 entry.path() << " was left behind");
  }
  // Until a record is there: the head alone is shorter than that.
  [[nodiscard]] bool wait_for_journal() const {
    for (int i = 0; i < 6000; ++i) {
      std::error_code none;
      const auto bytes = fs::file_size(journal(), none);
      if (!none && bytes > 4096) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }
  // A killed build leaves its journal and hidden temporary files, and an output only if it is whole.
  void nothing_is_half_written() const {
    for (const auto& entry : fs::directory_iterator(out)) {
      const std::string name = entry.path().filename().string();
      if (entry.path() == volume())
        BOOST_TEST(vdvr::content_sha256(vdvr::read_vdvr(volume()).volume) == hash);
      else
        BOOST_TEST((entry.path() == journal() || name.starts_with(".o.vdvr.")), name << " was left behind");
    }
  }
};

void kill_after(pid_t child, double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  ::kill(child, SIGKILL);
}

}  // namespace

BOOST_AUTO_TEST_CASE(build_killed_at_twenty_random_moments_and_resumed_has_the_same_content) {
  Work w;
  w.build_whole();
  std::mt19937 random(20);
  std::uniform_real_distribution<double> unit(0, 1);
  int with_journal = 0;
  for (int i = 0; i < 20; ++i) {
    const pid_t child = start(w.build(), w.messages);
    // Half of the moments lie anywhere, half where the journal grows.
    const bool late = i % 2 == 1 && w.wait_for_journal();
    kill_after(child, unit(random) * (late ? 0.12 : 1.02) * w.whole.count());
    finish(child);
    w.nothing_is_half_written();
    std::error_code none;
    const auto bytes = fs::file_size(w.journal(), none);
    with_journal += !none && bytes > 0 ? 1 : 0;
    if (!fs::exists(w.volume()) || fs::exists(w.journal()))
      BOOST_TEST(w.run(w.build("--resume")) == 0, w.said());
    BOOST_TEST(vdvr::content_sha256(vdvr::read_vdvr(w.volume()).volume) == w.hash);
    w.only_these_remain({w.volume()});
    fs::remove(w.volume());
  }
  BOOST_TEST_MESSAGE(with_journal << " of 20 kills left a journal; a whole build takes " << w.whole.count()
                                  << " s");
  BOOST_TEST(with_journal > 0);
}

BOOST_AUTO_TEST_CASE(build_killed_again_and_again_gets_there) {
  Work w;
  w.build_whole();
  const double slice = 0.75 * w.whole.count();
  bool done = false;
  for (int i = 0; i < 4 && !done; ++i) {
    const pid_t child = start(w.build("--resume"), w.messages);
    kill_after(child, slice);
    done = finish(child) == 0;
    w.nothing_is_half_written();
  }
  if (!done) BOOST_TEST(w.run(w.build("--resume")) == 0, w.said());
  BOOST_TEST(vdvr::content_sha256(vdvr::read_vdvr(w.volume()).volume) == w.hash);
  w.only_these_remain({w.volume()});
}

BOOST_AUTO_TEST_CASE(interrupted_build_says_that_resume_continues) {
  Work w;
  w.build_whole();
  const pid_t child = start(w.build(), w.messages);
  BOOST_TEST(w.wait_for_journal());
  ::kill(child, SIGTERM);
  BOOST_TEST(finish(child) == 143);
  BOOST_TEST(w.said().find("--resume continues") != std::string::npos, w.said());
  BOOST_TEST(fs::exists(w.journal()));
  auto other = w.build("--resume");
  other[3] = "16%";
  BOOST_TEST(w.run(other) == 2);
  BOOST_TEST(w.said().find("epsilon was") != std::string::npos, w.said());
  BOOST_TEST(w.run(w.build("--resume")) == 0, w.said());
  BOOST_TEST(vdvr::content_sha256(vdvr::read_vdvr(w.volume()).volume) == w.hash);
  BOOST_TEST(w.run(w.build("--resume")) == 2);  // it exists now, and nothing is left to resume
}

BOOST_AUTO_TEST_CASE(run_killed_and_resumed_has_the_same_content_and_all_its_files) {
  Work w;
  w.build_whole();
  const auto words = [&](const std::string& more) {
    std::vector<std::string> all{"run", w.scan.string(), "--epsilon", "15%", "--max-memory",
                                 "40M", "--granularity", "2",         "-o",  w.out.string()};
    if (!more.empty()) all.push_back(more);
    return all;
  };
  const auto begin = Clock::now();
  BOOST_REQUIRE_MESSAGE(w.run(words("")) == 0, w.said());
  const std::chrono::duration<double> whole = Clock::now() - begin;
  const auto files = std::distance(fs::directory_iterator(w.out), fs::directory_iterator());
  for (const double share : {0.6, 0.9}) {
    fs::remove_all(w.out);
    const pid_t child = start(words(""), w.messages);
    kill_after(child, share * whole.count());
    finish(child);
    if (fs::exists(w.out / "certificate.json") && !fs::exists(w.out / "volume.vdvr.journal")) continue;
    BOOST_TEST(w.run(words("--resume")) == 0, w.said());
    BOOST_TEST(vdvr::content_sha256(vdvr::read_vdvr(w.out / "volume.vdvr").volume) == w.hash);
    BOOST_TEST(std::distance(fs::directory_iterator(w.out), fs::directory_iterator()) == files);
  }
}
