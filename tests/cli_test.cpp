// Runs the program itself: exit codes, one-line messages, nothing overwritten, JSON alone on standard output.
#define BOOST_TEST_MODULE cli
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <cstring>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "vdvr/vdvr_file.hpp"

namespace fs = std::filesystem;

namespace {

/// A folder of this test process, removed at its end.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("vdvr_cli_test_" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

const Folder& folder() {
  static const Folder one;
  return one;
}

std::string at(const std::string& name) { return (folder().path / name).string(); }

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

struct Result {
  int code = -1;
  std::string out, err;
};

/// Starts the program with its output in two files; the child's id.
pid_t start(const std::vector<std::string>& words) {
  std::vector<std::string> all{VDVR_BINARY};
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> argv;
  std::transform(all.begin(), all.end(), std::back_inserter(argv), [](std::string& s) { return s.data(); });
  argv.push_back(nullptr);
  const std::string out = at("stdout"), err = at("stderr");
  write(err, "");  // an earlier call's text must not be taken for this one's
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
    ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  return child;
}

Result finish(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), contents(at("stdout")),
          contents(at("stderr"))};
}

Result run(const std::vector<std::string>& words) { return finish(start(words)); }

bool is_one_line(const std::string& text) {
  return !text.empty() && text.back() == '\n' && std::count(text.begin(), text.end(), '\n') == 1;
}

/// The last line says what is wrong; progress lines of stages may stand before it.
std::string last_line(const std::string& text) {
  const std::size_t end = text.empty() ? 0 : text.size() - 1;
  const std::size_t begin = text.rfind('\n', end == 0 ? 0 : end - 1);
  return text.substr(begin == std::string::npos ? 0 : begin + 1);
}

void check_refused(const std::vector<std::string>& words, const std::string& named = "") {
  const Result r = run(words);
  BOOST_TEST_CONTEXT("vdvr " << words[0] << " ... " << words.back() << " said: " << r.err) {
    BOOST_TEST(r.code == 2);
    BOOST_TEST(r.out.empty());
    BOOST_TEST(last_line(r.err).rfind("vdvr " + words[0] + ": ", 0) == 0);
    BOOST_TEST(r.err.find(named) != std::string::npos);
  }
}

const std::vector<std::string> kCommands{"devices", "simulate", "info",   "reconstruct", "plan", "build",
                                         "verify",  "probe",    "render", "export",      "run",  "bench"};

/// The words of each command that reads a file, with that file in the place of IN.
std::vector<std::vector<std::string>> readers(const std::string& input) {
  const std::string points = at("points.csv");
  write(points, "x,y,z\n0,0,0\n");
  return {{"info", input},
          {"reconstruct", input, "-o", at("o.mha")},
          {"plan", input, "--epsilon", "3%"},
          {"build", input, "--epsilon", "3%", "-o", at("o.vdvr")},
          {"verify", input, "--projections", input},
          {"probe", input, "--exact", "--points", points, "-o", at("o.csv")},
          {"render", input, "-o", at("o.png")},
          {"export", input, "-o", at("o.mha")},
          {"run", input, "--epsilon", "3%", "-o", at("o.dir")},
          {"simulate", "--volume", input, "-o", at("o.h5")},
          {"bench", "build", input, "--epsilon", "3%"},
          {"bench", "render", input}};
}

/// A small scan of a sphere, made once.
const std::string& small_scan() {
  static const std::string path = [] {
    const std::string file = at("sphere.h5");
    const Result r = run(
        {"simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "48", "-o", file, "--force"});
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return file;
  }();
  return path;
}

}  // namespace

BOOST_AUTO_TEST_CASE(version_and_overview_are_printed) {
  const Result version = run({"--version"});
  BOOST_TEST(version.code == 0);
  BOOST_TEST(version.out.rfind("vdvr ", 0) == 0);
  const Result overview = run({"--help"});
  BOOST_TEST(overview.code == 0);
  for (const auto& command : kCommands) BOOST_TEST(overview.out.find("  " + command) != std::string::npos);
}

BOOST_AUTO_TEST_CASE(every_command_explains_itself) {
  for (const auto& command : kCommands) {
    const Result r = run({command, "--help"});
    BOOST_TEST(r.code == 0);
    BOOST_TEST(r.out.rfind("usage: vdvr " + command, 0) == 0);
    BOOST_TEST(r.err.empty());
  }
}

BOOST_AUTO_TEST_CASE(unknown_words_are_refused_in_one_line) {
  BOOST_TEST(run({"frobnicate"}).code == 2);
  for (const auto& command : kCommands) {
    const Result r = run({command, "--frobnicate"});
    BOOST_TEST(r.code == 2);
    BOOST_TEST(is_one_line(r.err));
    BOOST_TEST(r.err.find("frobnicate") != std::string::npos);
  }
  check_refused({"info", "a", "b"}, "too many");
  check_refused({"info"}, "FILE is missing");
}

BOOST_AUTO_TEST_CASE(bad_numbers_are_refused_by_option) {
  const std::string o = at("bad.vdvr");
  check_refused({"plan", "x.h5"}, "--epsilon");
  check_refused({"plan", "x.h5", "--epsilon", "3"}, "3%");
  check_refused({"plan", "x.h5", "--epsilon", "-3%"}, "--epsilon");
  check_refused({"plan", "x.h5", "--epsilon", "nan"}, "--epsilon");
  check_refused({"plan", "x.h5", "--epsilon", "3%", "--epsilon-abs", "1"}, "--epsilon");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--size", "4x4"}, "--size");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--size", "4x0x4"}, "--size");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--size", "99999999999999999999x4x4"},
                "--size");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--origin", "-1,-2"}, "--origin");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--compression", "zip"}, "--compression");
  check_refused({"plan", "x.h5", "--epsilon", "3%", "--compression", "none"}, "--compression");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--granularity", "3"}, "--granularity");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--upsampling", "3"}, "--upsampling");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--max-memory", "lots"}, "--max-memory");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--filter", "none"}, "--filter");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--storage", "u32"}, "--storage");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--closing", "fine"}, "--closing");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--levels", "none"}, "--levels");
  check_refused({"build", "x.h5", "--epsilon", "3%", "-o", o, "--closing", "paper", "--coefficients",
                 "sampled", "--levels", "anisotropic"},
                "--levels isotropic");
}

BOOST_AUTO_TEST_CASE(projections_are_drawn_only_as_d2vr_can) {
  const auto d2vr = [&](const std::vector<std::string>& more, const std::string& named) {
    std::vector<std::string> words{"render", "x.h5", "-o", at("d2vr.png"), "--method", "d2vr"};
    words.insert(words.end(), more.begin(), more.end());
    check_refused(words, named);
  };
  for (const char* mode : {"iso", "mip", "slice"}) d2vr({"--mode", mode}, "--mode dvr");
  d2vr({"--classification", "preintegrated"}, "--classification");
  d2vr({"--step-mode", "level"}, "--step-mode");
  d2vr({"--gradient", "stored"}, "--gradient");
  d2vr({"--sampler", "image3d"}, "--sampler");
  check_refused({"render", "x.vdvr", "-o", at("d2vr.png"), "--cells", "4x4x4"}, "--method d2vr");
  check_refused({"bench", "render", "x.vdvr", "--no-skip"}, "--method d2vr");
}

BOOST_AUTO_TEST_CASE(settings_that_exclude_each_other_are_refused) {
  const std::vector<std::string> build{"build", "x.h5", "--epsilon", "3%", "-o", at("excluded.vdvr")};
  const auto with = [&](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  check_refused(with(build, {"--closing", "paper"}), "--coefficients sampled");
  check_refused(with(build, {"--paper", "--coefficients", "midrange"}), "--coefficients sampled");
  check_refused({"run", "x.h5", "--epsilon", "3%", "-o", at("run"), "--paper"}, "use vdvr build");
}

BOOST_AUTO_TEST_CASE(views_that_contradict_themselves_are_refused) {
  const auto render = [&](const std::string& output, const std::vector<std::string>& more,
                          const std::string& named) {
    std::vector<std::string> words{"render", "x.mha", "-o", at(output)};
    words.insert(words.end(), more.begin(), more.end());
    check_refused(words, named);
  };
  render("x.png", {"--camera-position", "1,2,3", "--azimuth", "3"}, "--azimuth");
  render("x.png", {"--camera-view-angle", "20", "--zoom", "2"}, "--zoom");
  render("x.png", {"--camera-position", "1,2,3", "--turntable", "4"}, "--turntable");
  render("x.png", {"--turntable", "4"}, ".apng");
  render("x.gif", {}, "--turntable");
  render("x.jpg", {}, ".png");
  render("x.npy", {"--axes"}, "--axes");
  render("x.png", {"--mode", "slice", "--box"}, "--box");
  render("x.png", {"--mode", "slice", "--azimuth", "3"}, "--azimuth");
  render("x.png", {"--mode", "iso", "--colorbar"}, "--colorbar");
  render("x.png", {"--mode", "iso", "--tf", "bone"}, "--tf");
  render("x.png", {"--mode", "mip", "--no-shading"}, "--no-shading");
  render("x.png", {"--mode", "mip", "--show", "normal"}, "--show");
  render("x.png", {"--mode", "slice", "--show", "depth"}, "--show");
  render("x.png", {"--mode", "iso", "--show", "depth", "--box"}, "--box");
  render("x.png", {"--iso-opacity", "0.5"}, "--iso-opacity");
  render("x.png", {"--background", "1,2,3"}, "--background");
  render("x.png", {"--light", "left"}, "--light");
  render("x.png", {"--light", "1,2"}, "--light");
  render("x.png", {"--light", "head", "--no-shading"}, "--light");
  render("x.png", {"--mode", "mip", "--gradient", "central"}, "--gradient");
  render("x.png", {"--mode", "iso", "--step-mode", "level"}, "--step-mode");
  render("x.png", {"--mode", "slice", "--classification", "post"}, "--classification");
  render("x.png", {"--classification", "preintegrated", "--step-mode", "level"}, "--step-mode");
  render("x.png", {"--background", "0.5,0.5"}, "--background");
}

BOOST_AUTO_TEST_CASE(presets_are_listed_without_a_volume) {
  const Result r = run({"render", "--tf", "list"});
  BOOST_TEST(r.code == 0);
  BOOST_TEST(r.out.find("marschner-lobb") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_volume_is_rendered_as_picture_values_and_turntable) {
  const std::string volume = at("ramp.mha");
  {
    std::string bytes =
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 8 8 8\nElementType = MET_UCHAR\n"
        "ElementDataFile = LOCAL\n";
    for (int i = 0; i < 512; ++i) bytes.push_back(static_cast<char>(i % 64));
    write(volume, bytes);
  }
  const std::vector<std::string> render{"render", volume, "--size", "24x16", "--quiet", "--force"};
  const auto draw = [&](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> words = render;
    words.insert(words.end(), {"-o", at(output)});
    words.insert(words.end(), more.begin(), more.end());
    const Result r = run(words);
    BOOST_TEST(r.code == 0, r.err);
    BOOST_TEST(r.out.empty());
  };
  draw("ramp.png", {"--tf", "bone", "--axes", "--box", "--colorbar", "--caption"});
  for (const char* mode : {"dvr", "iso", "mip", "slice"}) {
    draw("ramp.npy", {"--mode", mode});
    const std::string bytes = contents(at("ramp.npy"));
    BOOST_TEST(bytes.find("(16, 24)") != std::string::npos);
    BOOST_TEST(bytes.size() % 64 == (16 * 24 * 4) % 64);
  }
  draw("ramp.png",
       {"--light", "head", "--light", "1,0,-1", "--gradient", "analytic", "--step-mode", "level"});
  draw("ramp.png", {"--classification", "preintegrated"});
  draw("ramp.apng", {"--turntable", "3", "--tf", "grey", "--tf-range", "0,63"});
  draw("ramp.gif", {"--turntable", "3"});
  BOOST_TEST(contents(at("ramp.gif")).rfind("GIF89a", 0) == 0);
  draw("turn", {"--turntable", "3"});
  BOOST_TEST(fs::exists(at("turn/frame-0002.png")));
  // A shorter turn leaves nothing of the longer one behind.
  draw("turn", {"--turntable", "2"});
  BOOST_TEST(!fs::exists(at("turn/frame-0002.png")));
  // The window of a slice: all of the ramp lies below the first two and above the third.
  const auto slice = [&](const char* window) {
    draw("window.png", {"--mode", "slice", "--tf-range", window});
    return contents(at("window.png"));
  };
  const std::string black = slice("1000,2000");
  BOOST_TEST((black == slice("3000,4000")));
  BOOST_TEST((black != slice("-2000,-1000")));
  BOOST_TEST((black != slice("auto")));
  check_refused({"render", volume, "-o", at("z.png"), "--mode", "slice", "--tf-range", "3,1"}, "--tf-range");
  check_refused({"render", volume, "-o", at("z.png"), "--mode", "error", "--tf-range", "1,3"}, "--tf-range");
  check_refused({"render", volume, "-o", at("z.png"), "--tf", "purple"}, "purple");
  check_refused({"render", volume, "-o", at("z.png"), "--tf-range", "3,1"}, "--tf-range");
  check_refused({"render", volume, "-o", at("z.png"), "--camera-position", "0,0,50", "--camera-focal-point",
                 "0,0,0", "--camera-view-up", "0,0,1"},
                "--camera-view-up");
  check_refused({"render", at("ramp.h5") + ":/volume", "-o", at("z.png")}, "ramp.h5: no such file");
}

BOOST_AUTO_TEST_CASE(missing_input_is_refused) {
  for (const auto& words : readers(at("does-not-exist.h5"))) check_refused(words, "does-not-exist.h5");
}

BOOST_AUTO_TEST_CASE(empty_input_is_refused) {
  for (const std::string name : {"empty.h5", "empty.vdvr", "empty.mha"}) {
    write(at(name), "");
    for (const auto& words : readers(at(name))) check_refused(words, name);
  }
}

BOOST_AUTO_TEST_CASE(input_of_another_kind_is_refused) {
  for (const std::string name : {"text.h5", "text.vdvr", "text.mha", "text.png"}) {
    write(at(name), "This is a letter, not a measurement.\n");
    for (const auto& words : readers(at(name))) check_refused(words, name);
  }
}

BOOST_AUTO_TEST_CASE(truncated_input_is_refused) {
  const std::string whole = contents(small_scan());
  for (const std::string name : {"half.h5", "half.vdvr"}) {
    write(at(name), whole.substr(0, whole.size() / 2));
    for (const auto& words : readers(at(name))) check_refused(words, name);
  }
}

BOOST_AUTO_TEST_CASE(refusals_leave_no_output_behind) {
  for (const std::string name : {"o.mha", "o.vdvr", "o.csv", "o.png", "o.dir", "o.h5"})
    BOOST_TEST(!fs::exists(at(name)));
  for (const auto& entry : fs::directory_iterator(folder().path))
    BOOST_TEST(entry.path().filename().string()[0] != '.', "temporary file left: " << entry.path());
}

BOOST_AUTO_TEST_CASE(nothing_is_overwritten_without_force) {
  const std::string scan = small_scan();
  const std::string before = contents(scan);
  check_refused({"simulate", "--phantom", "sphere", "-o", scan}, "--force");
  write(at("kept.mha"), "kept");
  check_refused({"reconstruct", scan, "-o", at("kept.mha")}, "--force");
  write(at("kept.vdvr"), "kept");
  check_refused({"build", scan, "--epsilon", "3%", "-o", at("kept.vdvr")}, "--force");
  fs::create_directories(at("kept.dir"));
  write(at("kept.dir/certificate.json"), "kept");
  check_refused({"run", scan, "--epsilon", "3%", "-o", at("kept.dir")}, "--force");
  BOOST_TEST(contents(scan) == before);
  BOOST_TEST(contents(at("kept.mha")) == "kept");
  BOOST_TEST(contents(at("kept.vdvr")) == "kept");
  BOOST_TEST(contents(at("kept.dir/certificate.json")) == "kept");
}

BOOST_AUTO_TEST_CASE(an_input_is_never_the_output) {
  const std::string scan = small_scan();
  const std::string before = contents(scan);
  check_refused({"build", scan, "--epsilon", "3%", "-o", scan, "--force"}, "also the input");
  BOOST_TEST(contents(scan) == before);
}

BOOST_AUTO_TEST_CASE(json_stands_alone_on_standard_output) {
  const std::string scan = small_scan();
  const std::string volume = at("json.vdvr");
  const std::vector<std::vector<std::string>> calls{
      {"devices"},
      {"info", scan},
      {"reconstruct", scan, "-o", at("json.mha"), "--upsampling", "2"},
      {"info", at("json.mha")},
      {"plan", scan, "--epsilon", "20%"},
      {"build", scan, "--epsilon", "20%", "-o", volume},
      {"info", volume},
      {"verify", volume, "--projections", scan},
      {"export", volume, "-o", at("json-export.mha")},
      {"render", volume, "-o", at("json.png"), "--size", "32x32"},
      {"render", volume, "-o", at("json-error.png"), "--mode", "error", "--projections", scan, "--size",
       "256x256"}};
  for (auto words : calls) {
    words.emplace_back("--json");
    const Result r = run(words);
    BOOST_TEST_CONTEXT("vdvr " << words[0] << " said: " << r.err) {
      BOOST_TEST(r.code == 0);
      BOOST_TEST(nlohmann::json::parse(r.out, nullptr, false).is_object());
    }
  }
}

BOOST_AUTO_TEST_CASE(an_error_picture_without_projections_is_what_the_certificate_says_of_each_brick) {
  const std::string volume = at("json.vdvr"), picture = at("bound.npy");
  const auto certificate =
      nlohmann::json::parse(run({"info", volume, "--json"}).out, nullptr, false)["certificate"];
  const Result r =
      run({"render", volume, "-o", picture, "--mode", "error", "--size", "160x64", "--json", "--force"});
  BOOST_REQUIRE_EQUAL(r.code, 0);
  const auto json = nlohmann::json::parse(r.out, nullptr, false);
  const double total = certificate["total"]["buffer"].get<double>();
  const std::vector<float> bounds = vdvr::brick_bounds(vdvr::read_vdvr(volume).certificate, false);
  const std::set<float> known(bounds.begin(), bounds.end());
  BOOST_TEST(total <= certificate["epsilon_abs"].get<double>());
  // Beside the slice, whose pixels are square, there is nothing.
  const std::string bytes = contents(picture);
  BOOST_TEST(bytes.size() % 64 == (160 * 64 * 4) % 64);
  std::int64_t bounded = 0;
  float largest = 0;
  for (std::size_t i = bytes.size() - 160 * 64 * 4; i < bytes.size(); i += 4) {
    float value = 0;
    std::memcpy(&value, bytes.data() + i, 4);
    if (std::isnan(value)) continue;
    ++bounded;
    BOOST_REQUIRE(known.contains(value));
    largest = std::max(largest, value);
  }
  BOOST_TEST(json["bound"].get<double>() == static_cast<double>(largest));
  // Two sums and a product in fp32 lie between the total of the whole and the largest of a brick.
  BOOST_TEST(static_cast<double>(largest) <= total * (1 + 0x1p-19));
  BOOST_TEST(bounded == json["pixels"].get<std::int64_t>());
  BOOST_TEST(bounded > 0);
  BOOST_TEST(run({"render", volume, "-o", at("bound.png"), "--mode", "error"}).code == 0);
  BOOST_TEST(fs::exists(at("bound.png")));
  // And along rays, of what is seen.
  const std::string seen = at("seen.npy");
  BOOST_REQUIRE_EQUAL(run({"render", volume, "-o", seen, "--show", "error", "--size", "64x64"}).code, 0);
  const std::string pixels = contents(seen);
  std::int64_t shown = 0;
  for (std::size_t i = pixels.size() - 64 * 64 * 4; i < pixels.size(); i += 4) {
    float value = 0;
    std::memcpy(&value, pixels.data() + i, 4);
    if (std::isnan(value)) continue;
    ++shown;
    BOOST_REQUIRE(known.contains(value));
  }
  BOOST_TEST(shown > 0);
  BOOST_TEST(run({"render", volume, "-o", at("seen.png"), "--show", "error"}).code == 0);
  check_refused({"render", volume, "-o", at("no.png"), "--show", "error", "--method", "dvr"}, "--show error");
}

BOOST_AUTO_TEST_CASE(info_shows_storage_beside_the_certificate) {
  const std::string volume = at("json.vdvr");
  const auto json = nlohmann::json::parse(run({"info", volume, "--json"}).out, nullptr, false);
  BOOST_REQUIRE(json.is_object());
  BOOST_TEST(json["certificate"]["holds"]["buffer"].get<bool>());
  for (const std::string key : {"samples_ratio", "bytes_ratio", "file_bytes"}) {
    BOOST_TEST(json["storage"].contains(key));
    BOOST_TEST(json["storage"]["interior"].contains(key));
  }
  BOOST_TEST(json["storage"]["file_bytes"].get<std::uintmax_t>() == fs::file_size(volume));
}

BOOST_AUTO_TEST_CASE(verify_rejects_other_projections_with_code_1) {
  const std::string other = at("other.h5");
  BOOST_REQUIRE(
      run({"simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "47", "-o", other}).code ==
      0);
  const Result r = run({"verify", at("json.vdvr"), "--projections", other});
  BOOST_TEST(r.code == 1);
  BOOST_TEST(last_line(r.err).find("sha256") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(projections_are_drawn_and_probed_without_a_volume) {
  const std::string scan = small_scan(), picture = at("d2vr.npy"), without = at("d2vr-no-skip.npy");
  const Result r = run({"render", scan, "--method", "d2vr", "--size", "24x24", "-o", picture, "--json"});
  BOOST_REQUIRE(r.code == 0);
  const auto json = nlohmann::json::parse(r.out);
  BOOST_TEST(json.at("method") == "d2vr");
  BOOST_TEST(json.at("verified") == false);
  BOOST_TEST(json.at("resident_bytes").get<double>() > 0);
  BOOST_REQUIRE(
      run({"render", scan, "--method", "d2vr", "--size", "24x24", "--no-skip", "-o", without}).code == 0);
  BOOST_TEST(contents(picture) == contents(without));

  write(at("q.csv"), "x,y,z\n0,0,0\n1000,0,0\n");
  BOOST_REQUIRE(run({"probe", scan, "--method", "d2vr", "--points", at("q.csv"), "-o", at("d.csv")}).code ==
                0);
  std::istringstream lines(contents(at("d.csv")));
  std::string line;
  std::getline(lines, line);
  std::getline(lines, line);
  BOOST_TEST(line.rfind("0,0,0,", 0) == 0);
  BOOST_TEST(line.substr(line.size() - 4) == ",,,1");
  std::getline(lines, line);
  BOOST_TEST(line == "1000,0,0,,,,0");
  check_refused({"probe", scan, "--method", "d2vr", "--exact", "--points", at("q.csv"), "-o", at("e.csv")},
                "--exact");
}

BOOST_AUTO_TEST_CASE(probe_answers_every_point_in_order) {
  write(at("p.csv"), "x,y,z\n0,0,0\n1000,0,0\n-2.5,1.25,0.5\n");
  const std::string volume = at("json.vdvr"), scan = small_scan();
  BOOST_REQUIRE(run({"probe", volume, "--points", at("p.csv"), "-o", at("v.csv")}).code == 0);
  BOOST_REQUIRE(
      run({"probe", scan, "--exact", "--like", volume, "--points", at("p.csv"), "-o", at("f.csv")}).code ==
      0);
  std::ifstream certified(at("v.csv")), exact(at("f.csv"));
  std::string v, f;
  std::getline(certified, v);
  std::getline(exact, f);
  BOOST_TEST(v == "x,y,z,value,bound,level,covered");
  BOOST_TEST(f == v);
  for (int point = 0; point < 3; ++point) {
    BOOST_REQUIRE(std::getline(certified, v));
    BOOST_REQUIRE(std::getline(exact, f));
    if (point == 1) {
      BOOST_TEST(v == "1000,0,0,,,,0");
      BOOST_TEST(f == v);
      continue;
    }
    double x = 0, y = 0, z = 0, value = 0, bound = 0, truth = 0;
    BOOST_REQUIRE(std::sscanf(v.c_str(), "%lf,%lf,%lf,%lf,%lf", &x, &y, &z, &value, &bound) == 5);
    BOOST_REQUIRE(std::sscanf(f.c_str(), "%lf,%lf,%lf,%lf", &x, &y, &z, &truth) == 4);
    BOOST_TEST(std::abs(value - truth) <= bound);
  }
  write(at("bad.csv"), "x,y,z\n1,2\n");
  check_refused({"probe", volume, "--points", at("bad.csv"), "-o", at("bad-out.csv")}, "line 2");
  check_refused({"probe", scan, "--points", at("p.csv"), "-o", at("bad-out.csv")}, "--exact");
}

BOOST_AUTO_TEST_CASE(interruption_leaves_nothing_behind) {
  const std::string scan = small_scan(), file = at("interrupted"), dir = at("interrupted.dir");
  const std::vector<std::vector<std::string>> calls{
      {"simulate", "--phantom", "sphere", "--detector", "257x257", "--angles", "720", "-o", file + ".h5"},
      {"reconstruct", scan, "--size", "256x256x64", "-o", file + ".mha"},
      {"build", scan, "--epsilon", "3%", "-o", file + ".vdvr"},
      {"run", scan, "--epsilon", "3%", "-o", dir}};
  for (const auto& words : calls) {
    for (const int signal : {SIGINT, SIGTERM}) {
      const pid_t child = start(words);
      // The first line of progress is the sign that work has begun.
      for (int wait = 0; wait < 20000 && contents(at("stderr")).empty(); ++wait)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ::kill(child, signal);
      const Result r = finish(child);
      BOOST_TEST_CONTEXT("vdvr " << words[0] << " said: " << r.err) {
        BOOST_TEST(r.code == 128 + signal);
        BOOST_TEST(!fs::exists(words.back()));
      }
    }
  }
  for (const auto& entry : fs::directory_iterator(folder().path))
    BOOST_TEST(entry.path().filename().string()[0] != '.', "temporary file left: " << entry.path());
}

BOOST_AUTO_TEST_CASE(plan_draws_pictures_and_overwrites_none_without_force) {
  const fs::path output = at("plan-pictures");
  const std::vector<std::string> words{"plan",       small_scan(),    "--epsilon", "20%",
                                       "--pictures", output.string(), "--json"};
  const Result r = run(words);
  BOOST_TEST_CONTEXT(r.err) { BOOST_REQUIRE(r.code == 0); }
  const auto json = nlohmann::json::parse(r.out, nullptr, false);
  BOOST_REQUIRE(json.is_object());
  BOOST_TEST(json["pictures"]["files"].size() == 7u);
  for (const auto& [name, shows] : json["pictures"]["files"].items())
    BOOST_TEST(contents(output / name).substr(1, 3) == "PNG", name);
  const auto numbers = nlohmann::json::parse(contents(output / "pictures.json"), nullptr, false);
  BOOST_REQUIRE(numbers.is_object());
  for (const std::string spectrum : {"row", "projection", "volume"}) {
    double before = std::numeric_limits<double>::infinity();
    for (const auto& sum : numbers[spectrum]["sums"]) {
      const double bound = sum["amplitude_bound"].get<double>();
      BOOST_TEST(bound > 0);
      BOOST_TEST(bound < before);
      BOOST_TEST(bound >= sum["with_closed_form"].get<double>());
      before = bound;
    }
  }

  write(output / "row.png", "kept");
  check_refused(words, "--force");
  BOOST_TEST(contents(output / "row.png") == "kept");
  std::vector<std::string> forced = words;
  forced.emplace_back("--force");
  BOOST_TEST(run(forced).code == 0);
  BOOST_TEST(contents(output / "row.png").substr(1, 3) == "PNG");
  check_refused({"plan", small_scan(), "--epsilon", "20%", "--pictures", small_scan()}, "not a folder");
}

BOOST_AUTO_TEST_CASE(run_writes_the_certificate_and_the_pictures) {
  const std::string output = at("run");
  const Result r = run({"run", small_scan(), "--epsilon", "20%", "-o", output, "--json"});
  BOOST_TEST_CONTEXT(r.err) { BOOST_REQUIRE(r.code == 0); }
  const auto json = nlohmann::json::parse(r.out, nullptr, false);
  BOOST_REQUIRE(json.is_object());
  for (const auto& [name, what] : json["files"].items())
    BOOST_TEST(fs::exists(fs::path(output) / name), name);
  const auto certificate =
      nlohmann::json::parse(contents(fs::path(output) / "certificate.json"), nullptr, false);
  BOOST_REQUIRE(certificate.is_object());
  BOOST_TEST(certificate["holds"]["buffer"].get<bool>());
  BOOST_TEST(json["error_slice"]["max_error"].get<double>() <= certificate["epsilon_abs"].get<double>());
}
