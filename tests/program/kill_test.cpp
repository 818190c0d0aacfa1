// Kills build, run, render and reconstruct at random moments: the output is the old one or the whole new one,
// --resume always ends in the same content, and nothing is left behind. VDVR_KILLS=N kills each of the four
// N times, and reports how the kills fell (the long form); without it a few times.
#define BOOST_TEST_MODULE kill
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "tests/support/places.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/vdvr_file.hpp"

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

/// Starts the program with its messages in a file; its process.
pid_t start(const std::vector<std::string>& words, const fs::path& messages) {
  std::vector<std::string> all{vdvr::support::vdvr_binary};
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
    // Little memory lets few blocks share a batch, hence many records.
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

int kills(int otherwise) {
  const char* asked = std::getenv("VDVR_KILLS");
  return asked == nullptr ? otherwise : std::atoi(asked);
}

// A command that writes one file, killed while it replaces an old one.
struct Replacement {
  std::vector<std::string> words;  // of the command, without -o
  std::string name;                // of the output
  unsigned seed;
  int times;

  void check(Work& w, const std::string& old_bytes) const {
    const fs::path output = w.out / name;
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--force", "-o", output.string()});
    const auto begin = Clock::now();
    BOOST_REQUIRE_MESSAGE(w.run(all) == 0, w.said());
    const std::chrono::duration<double> whole = Clock::now() - begin;
    const std::string new_bytes = vdvr::support::bytes_of(output);
    BOOST_REQUIRE((new_bytes != old_bytes));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    int old_ones = 0, new_ones = 0, torn = 0;
    for (int i = 0; i < times; ++i) {
      for (const auto& entry : fs::directory_iterator(w.out)) fs::remove(entry.path());
      std::ofstream(output, std::ios::binary) << old_bytes;
      const pid_t child = start(all, w.messages);
      // Every other one near the end, where the file is written and renamed.
      kill_after(child, (i % 2 == 0 ? unit(random) : 0.85 + 0.2 * unit(random)) * whole.count());
      finish(child);
      const std::string found = vdvr::support::bytes_of(output);
      BOOST_TEST((found == old_bytes || found == new_bytes),
                 "kill " << i << ": neither the old nor the new file");
      ++(found == old_bytes ? old_ones : new_ones);
      for (const auto& entry : fs::directory_iterator(w.out))
        if (entry.path() != output) {
          ++torn;
          BOOST_TEST(entry.path().filename().string().starts_with("." + name + "."),
                     entry.path() << " was left behind");
        }
      BOOST_TEST(w.run(all) == 0, w.said());
      BOOST_TEST((vdvr::support::bytes_of(output) == new_bytes));
    }
    BOOST_TEST_MESSAGE(words[0] << ": " << times << " kills: " << old_ones << " left the old file, "
                                << new_ones << " the new one, " << torn
                                << " a hidden temporary file; a whole one takes " << whole.count() << " s");
  }
};

}  // namespace

BOOST_AUTO_TEST_CASE(build_killed_at_random_moments_and_resumed_has_the_same_content) {
  const int times = kills(20);
  Work w;
  w.build_whole();
  std::mt19937 random(20);
  std::uniform_real_distribution<double> unit(0, 1);
  int with_journal = 0;
  for (int i = 0; i < times; ++i) {
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
  BOOST_TEST_MESSAGE("build: " << times << " kills: " << with_journal << " left a journal; a whole one takes "
                               << w.whole.count() << " s");
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
    // Killed when all was in place, it left nothing to resume.
    done = finish(child) == 0 || (fs::exists(w.volume()) && !fs::exists(w.journal()));
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
  const int times = kills(3);
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
  std::map<std::string, std::string> files;  // bytes of each, uninterrupted
  for (const auto& entry : fs::directory_iterator(w.out))
    files[entry.path().filename().string()] = vdvr::support::bytes_of(entry.path());
  // What stands under its own name is whole: pictures to the bit, the volume by its hash, JSON and the page
  // to their ends.
  const auto is_whole = [&](const fs::path& path) {
    const std::string name = path.filename().string();
    if (!files.contains(name)) return false;
    if (path.extension() == ".png") return vdvr::support::bytes_of(path) == files[name];
    if (path.extension() == ".vdvr") return vdvr::content_sha256(vdvr::read_vdvr(path).volume) == w.hash;
    // The page names seconds of its own run.
    if (path.extension() == ".html") return vdvr::support::bytes_of(path).ends_with("</html>\n");
    return nlohmann::json::accept(vdvr::support::bytes_of(path));
  };
  std::mt19937 random(60);
  std::uniform_real_distribution<double> unit(0, 1);
  int with_journal = 0, ended = 0;
  for (int i = 0; i < times; ++i) {
    fs::remove_all(w.out);
    const pid_t child = start(words(""), w.messages);
    kill_after(child, unit(random) * whole.count());
    finish(child);
    if (fs::exists(w.out))
      for (const auto& entry : fs::directory_iterator(w.out)) {
        const std::string name = entry.path().filename().string();
        BOOST_TEST((name.starts_with(".") || name.ends_with(".journal") || is_whole(entry.path())),
                   name << " is half-written after kill " << i);
      }
    with_journal += fs::exists(w.out / "volume.vdvr.journal") ? 1 : 0;
    if (fs::exists(w.out / "certificate.json") && !fs::exists(w.out / "volume.vdvr.journal")) {
      ++ended;
      continue;
    }
    BOOST_TEST(w.run(words("--resume")) == 0, w.said());
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(w.out)) {
      ++count;
      BOOST_TEST(is_whole(entry.path()), entry.path() << " after kill " << i << " and --resume");
    }
    BOOST_TEST(count == files.size());
  }
  BOOST_TEST_MESSAGE("run: " << times << " kills: " << with_journal << " left a journal, " << ended
                             << " found it done; a whole one takes " << whole.count() << " s");
}

BOOST_AUTO_TEST_CASE(render_killed_leaves_the_old_picture_or_the_whole_new_one) {
  Work w;
  BOOST_REQUIRE_MESSAGE(w.run(w.build()) == 0, w.said());
  const fs::path volume = w.folder / "o.vdvr";
  fs::rename(w.volume(), volume);
  const auto words = [&](const std::string& azimuth) {
    return std::vector<std::string>{"render",    volume.string(), "--size",    "256x192",
                                    "--sampler", "buffer",        "--azimuth", azimuth};
  };
  auto old = words("0");
  old.insert(old.end(), {"-o", (w.out / "o.png").string()});
  BOOST_REQUIRE_MESSAGE(w.run(old) == 0, w.said());
  Replacement{words("30"), "o.png", 70, kills(4)}.check(w, vdvr::support::bytes_of(w.out / "o.png"));
}

BOOST_AUTO_TEST_CASE(reconstruct_killed_leaves_the_old_volume_or_the_whole_new_one) {
  Work w;
  const auto words = [&](const std::string& filter) {
    return std::vector<std::string>{"reconstruct", w.scan.string(), "--filter", filter};
  };
  auto old = words("hann");
  old.insert(old.end(), {"-o", (w.out / "o.mha").string()});
  BOOST_REQUIRE_MESSAGE(w.run(old) == 0, w.said());
  Replacement{words("ram-lak"), "o.mha", 80, kills(4)}.check(w, vdvr::support::bytes_of(w.out / "o.mha"));
}
