// Sends SIGTERM or SIGINT to every command at random moments: it answers within a second on an idle machine,
// with exit code 143 or 130, and leaves either no output behind or all of it (a signal that comes after the
// last file is in place finds the work done). VDVR_INTERRUPTIONS=N interrupts
// each N times and reports the answers (the long form); without it twice. What is required here is laxer:
// other work on the machine delays any process.
#define BOOST_TEST_MODULE interrupt
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cstdlib>
#include <random>
#include <set>
#include <thread>

#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

constexpr double slowest_answer_s = 10;  // a loop that does not look takes minutes

struct Case {
  std::string name;
  std::vector<std::string> words;
  std::set<std::string> outputs = {};  ///< files, by name; what comes as a folder is whole by its last file
};

std::set<std::string> left_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (!entry.is_directory() && entry.path().extension() != ".journal")
      names.insert(entry.path().filename().string());
  return names;
}

struct Work {
  vdvr::support::TemporaryFolder folder;
  fs::path scan = folder / "scan.h5", volume = folder / "volume.vdvr", out = folder / "out";
  vdvr::support::Program program{folder / ""};

  Work() {
    const auto small = (folder / "small.h5").string();
    require({"simulate", "--phantom", "shepp-logan", "--detector", "25x13", "--pitch", "5.5", "--angles",
             "24", "-o", small});
    require({"build", small, "--epsilon", "15%", "-o", volume.string()});
    // Wide and flat: derivative tables and tables of verify take long, without a report between.
    require({"simulate", "--phantom", "sphere", "--detector", "384x6", "--angles", "150", "--noise-sigma",
             "0.3", "-o", scan.string()});
  }
  void require(const std::vector<std::string>& words) const {
    const auto ended = program.run(words);
    BOOST_REQUIRE_MESSAGE(ended.code == 0, words.front() << ": " << ended.err);
  }

  [[nodiscard]] std::vector<Case> cases() const {
    const std::string s = scan.string(), o = (out / "o").string();
    return {{"simulate",
             {"simulate", "--phantom", "shepp-logan", "--detector", "257x257", "--angles", "300",
              "--band-limited", "-o", o + ".h5"},
             {"o.h5"}},
            {"plan", {"plan", s, "--epsilon", "3%"}},
            {"build", {"build", s, "--epsilon", "25%", "-o", o + ".vdvr"}, {"o.vdvr"}},
            {"verify",
             {"verify", volume.string(), "--projections", (folder / "small.h5").string(), "--exhaustive"}},
            {"reconstruct",
             {"reconstruct", s, "--size", "640x640x16", "--spacing", "0.5", "-o", o + ".mha"},
             {"o.mha"}},
            {"render", {"render", volume.string(), "--size", "1500x1500", "-o", o + ".png"}, {"o.png"}},
            {"certified picture",
             {"render", volume.string(), "--certify", "--size", "1500x1500", "-o", o + ".png"},
             {"o.bound.png", "o.certificate.json", "o.png"}},
            {"probe",
             {"probe", s, "--exact", "--points", (folder / "points.csv").string(), "-o", o + ".csv"},
             {"o.csv"}},
            {"export", {"export", volume.string(), "--oversampling", "8", "-o", o + ".zarr"}},
            {"export of blocks", {"export", volume.string(), "-o", o + ".vtm"}, {"o.vtm"}},
            {"run", {"run", s, "--epsilon", "25%", "-o", (out / "all").string()}},
            {"bench", {"bench", "fbp", "--size", "257", "--angles", "300"}}};
  }
};

int times() {
  const char* asked = std::getenv("VDVR_INTERRUPTIONS");
  return asked == nullptr ? 2 : std::atoi(asked);
}

}  // namespace

BOOST_AUTO_TEST_CASE(every_command_answers_a_signal_soon) {
  const Work w;
  std::ofstream(w.folder / "points.csv") << [] {
    std::string text = "x,y,z\n";
    for (int i = 0; i < 60000; ++i)
      text += std::to_string(0.001 * i - 30) + "," + std::to_string(0.01 * i) + ",0." +
              std::to_string(i % 400) + "\n";
    return text;
  }();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Case& c : w.cases()) {
    double slowest = 0;
    int interrupted = 0;
    for (int i = 0; i < times(); ++i) {
      fs::remove_all(w.out);
      fs::create_directory(w.out);
      const int signal = i % 2 == 0 ? SIGTERM : SIGINT;
      const pid_t child = w.program.start(c.words);
      std::this_thread::sleep_for(std::chrono::duration<double>(0.1 + 4 * unit(random)));
      const auto asked = Clock::now();
      ::kill(child, signal);
      const auto ended = w.program.finish(child);
      const double answer = std::chrono::duration<double>(Clock::now() - asked).count();
      if (ended.code == 0 || ended.code == 1000 + signal) continue;  // done before, or not yet begun
      ++interrupted;
      slowest = std::max(slowest, answer);
      BOOST_TEST(ended.code == 128 + signal, c.name << " ended with " << ended.code << ": " << ended.err);
      BOOST_TEST(ended.err.find("interrupted") != std::string::npos, c.name << ": " << ended.err);
      BOOST_TEST(answer < slowest_answer_s, c.name << " took " << answer << " s to answer");
      const auto left = left_in(w.out);
      BOOST_TEST((left.empty() || left == c.outputs),
                 c.name << " left a part of its output: " << left.size() << " of " << c.outputs.size());
    }
    BOOST_TEST_MESSAGE(c.name << ": " << interrupted << " interrupted, the slowest answer " << slowest
                              << " s");
  }
}
