// What can fail around the program, provoked for real: full disks, folders that take no file, streams nobody
// reads, two runs to one output, an input that changes, no device, one that is too small, refuses memory, is
// lost or cannot build. Each ends in a message, the right exit code, and nothing half-written.
#define BOOST_TEST_MODULE faults
#include <sys/mount.h>

#include <boost/test/unit_test.hpp>
#include <utility>

#include "tests/support/program.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/vdvr_file.hpp"

namespace fs = std::filesystem;
using namespace vdvr;
using namespace vdvr::support;

namespace {

using Words = std::vector<std::string>;

/// A small scan and the volume made of it, once for all tests.
struct Inputs {
  TemporaryFolder folder;
  std::string scan = (folder / "scan.h5").string(), volume = (folder / "in.vdvr").string(),
              points = folder.file("points.csv", "x,y,z\n0,0,0\n").string();
  Inputs() {
    const Program program(folder.path());
    for (const Words& words :
         {Words{"simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "48", "-o", scan},
          Words{"build", scan, "--epsilon", "5%", "-o", volume}}) {
      const Ended made = program.run(words);
      BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
    }
  }
};

const Inputs& inputs() {
  static const Inputs one;
  return one;
}

/// Every command that writes a file, to `out` without its extension.
std::vector<Words> writers(const std::string& out) {
  const Inputs& in = inputs();
  return {{"simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "48", "-o", out + ".h5"},
          {"reconstruct", in.scan, "-o", out + ".mha"},
          {"build", in.scan, "--epsilon", "5%", "-o", out + ".vdvr"},
          {"export", in.volume, "-o", out + "-export.mha"},
          {"probe", in.volume, "--points", in.points, "-o", out + ".csv"},
          {"render", in.volume, "--size", "64x64", "-o", out + ".png"},
          {"run", in.scan, "--epsilon", "5%", "-o", out + ".dir"}};
}

/// Exports that are folders, or several files.
std::vector<Words> exports(const std::string& out) {
  const std::string& volume = inputs().volume;
  return {
      {"export", volume, "-o", out + ".npy"},  {"export", volume, "-o", out + ".tif"},
      {"export", volume, "-o", out + ".nrrd"}, {"export", volume, "--format", "tiff", "-o", out + "-slices"},
      {"export", volume, "-o", out + ".h5"},   {"export", volume, "-o", out + ".zarr"},
      {"export", volume, "-o", out + ".vtm"}};
}

std::vector<Words> writers_and_exports(const std::string& out) {
  std::vector<Words> all = writers(out), more = exports(out);
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

/// A stream of a program in no file. Holds 64 KiB: more would stop the program.
class Pipe {
 public:
  Pipe() { BOOST_REQUIRE(::pipe2(ends_, O_CLOEXEC) == 0); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    for (const int end : ends_)
      if (end >= 0) ::close(end);
  }
  [[nodiscard]] int write_end() const { return ends_[1]; }
  /// Once the program has ended.
  [[nodiscard]] std::string all() {
    ::close(std::exchange(ends_[1], -1));
    std::string text;
    char part[4096];
    for (ssize_t n = 0; (n = ::read(ends_[0], part, sizeof part)) > 0;)
      text.append(part, static_cast<std::size_t>(n));
    return text;
  }

 private:
  int ends_[2] = {-1, -1};
};

/// Files in a folder and below it, but for the streams of the program.
std::vector<std::string> files_below(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && !entry.path().filename().string().starts_with("std."))
      names.push_back(entry.path().filename().string());
  return names;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += name + " ";
  return text;
}

void check_failed(const Ended& r, int code, const Words& words, std::initializer_list<const char*> named) {
  BOOST_TEST_CONTEXT("vdvr " << joined(words) << "said: " << r.err) {
    BOOST_TEST(r.code == code);
    BOOST_TEST(r.err.find("vdvr " + words[0] + ": ") != std::string::npos);
    bool found = named.size() == 0;
    for (const char* part : named) found = found || r.err.find(part) != std::string::npos;
    BOOST_TEST(found);
  }
}

}  // namespace

// --- disks and folders

BOOST_AUTO_TEST_CASE(full_disk_ends_every_writer_with_code_3_and_no_file) {
  const TemporaryFolder folder, streams;
  Program program(streams.path());
  for (const Words& words : writers_and_exports((folder / "o").string())) {
    if (words[0] == "probe") continue;  // one line of CSV fits
    // Files of streams would be limited as well, and a compiler that cannot write its words to one (Intel's)
    // ends the process with a code of its own.
    Pipe messages;
    // A file may grow to 64 bytes: a write beyond fails as on a full disk.
    program.prepare = [&] {
      std::signal(SIGXFSZ, SIG_IGN);
      const rlimit most{64, 64};
      ::setrlimit(RLIMIT_FSIZE, &most);
      ::dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
      ::dup2(messages.write_end(), STDERR_FILENO);
    };
    Ended r = program.run(words);
    r.err = messages.all();
    // A compiler that writes files (PoCL's) fails before our writers do: those are met by the next case.
    check_failed(r, 3, words, {"disk", "space", "written", "added", "write failed", "does not build"});
    BOOST_TEST(joined(files_below(folder.path())) == "");
  }
}

BOOST_AUTO_TEST_CASE(file_system_of_any_small_size_holds_a_whole_file_or_none) {
  const TemporaryFolder folder, streams;
  const fs::path disk = folder / "disk";
  fs::create_directory(disk);
  const Program program(streams.path());
  int failed = 0, whole = 0;
  for (const char* size :
       {"size=4k", "size=16k", "size=32k", "size=48k", "size=56k", "size=80k", "size=1m"}) {
    if (::mount("none", disk.c_str(), "tmpfs", 0, size) != 0) {
      BOOST_TEST_MESSAGE("skipped: a file system cannot be mounted here");
      return;
    }
    for (const Words& words : writers((disk / "o").string())) {
      if (words[0] == "run" || words[0] == "probe") continue;
      const Ended r = program.run(words);
      const auto left = files_below(disk);
      BOOST_TEST_CONTEXT(size << ": vdvr " << joined(words) << "left " << joined(left) << "and said "
                              << r.err) {
        if (r.code == 0) {
          ++whole;
          BOOST_TEST(left.size() == 1u);
          if (words[0] != "render") BOOST_TEST(program.run({"info", words.back()}).code == 0);
        } else {
          ++failed;
          check_failed(r, 3, words, {"disk", "space", "written", "added"});
          BOOST_TEST(std::all_of(left.begin(), left.end(),
                                 [](const std::string& name) { return name.ends_with(".journal"); }));
        }
      }
      for (const auto& entry : fs::directory_iterator(disk)) fs::remove_all(entry.path());
    }
    for (const Words& words : exports((disk / "o").string())) {
      const Ended r = program.run(words);
      const auto left = files_below(disk);
      BOOST_TEST_CONTEXT(size << ": vdvr " << joined(words) << "left " << joined(left) << "and said "
                              << r.err) {
        BOOST_TEST((r.code == 0) == fs::exists(words.back()));
        if (r.code != 0) {
          check_failed(r, 3, words, {"disk", "space", "written"});
          BOOST_TEST(joined(left) == "");
        }
      }
      for (const auto& entry : fs::directory_iterator(disk)) fs::remove_all(entry.path());
    }
    ::umount(disk.c_str());
  }
  BOOST_TEST(failed >= 5);
  BOOST_TEST(whole >= 5);
}

BOOST_AUTO_TEST_CASE(folder_that_takes_no_file_is_named) {
  const TemporaryFolder streams;
  const Program program(streams.path());
  const std::string file = streams.file("file", "no folder").string();
  // Root may write anywhere but here, and a file is a folder to nobody.
  for (const std::string& where : {file + "/o", std::string("/proc/self/o")})
    for (const Words& words : writers_and_exports(where)) {
      const Ended r = program.run(words);
      check_failed(r, 2, words, {where.c_str(), file.c_str(), "/proc/self"});
      BOOST_TEST(!fs::exists(words.back()));
    }
}

// --- streams

BOOST_AUTO_TEST_CASE(result_that_cannot_be_printed_is_an_error) {
  const TemporaryFolder streams;
  Program program(streams.path());
  program.prepare = [] { ::dup2(::open("/dev/full", O_WRONLY), STDOUT_FILENO); };
  const Words words{"info", inputs().volume, "--json"};
  check_failed(program.run(words), 3, words, {"standard output", "cannot write"});
  program.prepare = [] {
    int ends[2];
    if (::pipe(ends) != 0) ::_exit(126);
    ::close(ends[0]);  // nobody reads
    ::dup2(ends[1], STDOUT_FILENO);
  };
  check_failed(program.run(words), 3, words, {"standard output", "cannot write"});
}

BOOST_AUTO_TEST_CASE(progress_that_nobody_reads_does_not_stop_the_work) {
  const TemporaryFolder folder, streams;
  Program program(streams.path());
  program.prepare = [] {
    int ends[2];
    if (::pipe(ends) != 0) ::_exit(126);
    ::close(ends[0]);
    ::dup2(ends[1], STDERR_FILENO);
  };
  const fs::path out = folder / "o.vdvr";
  BOOST_TEST(program.run({"build", inputs().scan, "--epsilon", "5%", "-o", out.string()}).code == 0);
  BOOST_TEST(content_sha256(read_vdvr(out).volume) == content_sha256(read_vdvr(inputs().volume).volume));
}

// --- other processes

BOOST_AUTO_TEST_CASE(two_builds_to_one_output_give_one_whole_file) {
  const TemporaryFolder folder, streams;
  const Program program(streams.path());
  const Words words{"build", inputs().scan, "--epsilon", "5%", "-o", (folder / "o.vdvr").string()};
  for (int round = 0; round < 3; ++round) {
    const pid_t a = program.start(words, "std.a"), b = program.start(words, "std.b");
    const Ended first = program.finish(a, "std.a"), second = program.finish(b, "std.b");
    BOOST_TEST_CONTEXT(first.err << second.err) {
      // The later one is refused: by the lock, or, where it came after the end, by the existing file.
      BOOST_TEST(std::min(first.code, second.code) == 0);
      BOOST_TEST(std::max(first.code, second.code) == 2);
      BOOST_TEST((first.err + second.err).find("o.vdvr") != std::string::npos);
    }
    BOOST_TEST(joined(files_below(folder.path())) == "o.vdvr ");
    const VdvrFile file = read_vdvr(folder / "o.vdvr");
    BOOST_TEST(content_sha256(file.volume) == file.certificate.content_sha256);
    fs::remove(folder / "o.vdvr");
  }
}

BOOST_AUTO_TEST_CASE(scan_that_changes_while_it_is_read_is_refused) {
  const TemporaryFolder folder;
  const fs::path scan = folder / "scan.h5";
  fs::copy(inputs().scan, scan);
  const auto read_and_change = [&](const std::function<void()>& change) {
    bool changed = false;
    static_cast<void>(read_scan(scan, {}, [&](const std::string&, double) {
      if (!changed) change();
      changed = true;
    }));
  };
  const auto names_it = [&](const FileError& e) {
    return std::string(e.what()).find(scan.string() + ": was changed") != std::string::npos;
  };
  BOOST_CHECK_EXCEPTION(read_and_change([&] { std::ofstream(scan, std::ios::app) << "more"; }), FileError,
                        names_it);
  BOOST_CHECK_EXCEPTION(read_and_change([&] {
                          fs::last_write_time(scan, fs::last_write_time(scan) + std::chrono::seconds(1));
                        }),
                        FileError, names_it);
  BOOST_CHECK_EXCEPTION(read_and_change([&] { fs::remove(scan); }), FileError, [&](const FileError& e) {
    return std::string(e.what()).find("scan.h5") != std::string::npos;
  });
}

// --- devices

BOOST_AUTO_TEST_CASE(no_device_is_said_with_the_remedy) {
  const TemporaryFolder folder, streams;
  Program program(streams.path());
  program.environment["OCL_ICD_VENDORS"] = folder.path().string();
  for (const Words& words : writers((folder / "o").string())) {
    if (words[0] == "simulate" || words[0] == "export" || words[0] == "probe") continue;  // need none
    check_failed(program.run(words), 3, words, {"no OpenCL device"});
    BOOST_TEST(joined(files_below(folder.path())) == "");
  }
  const Ended listed = program.run({"devices"});
  BOOST_TEST(listed.out.find("pocl-opencl-icd") != std::string::npos, listed.out + listed.err);
}

BOOST_AUTO_TEST_CASE(kernels_that_do_not_build_show_the_compilers_words) {
  const TemporaryFolder folder, streams;
  Program program(streams.path());
  program.environment["LD_PRELOAD"] = VDVR_OPENCL_SHIM;
  program.environment["VDVR_SHIM_BREAK_BUILD"] = "1";
  for (const Words& words : writers((folder / "o").string())) {
    if (words[0] == "simulate" || words[0] == "export" || words[0] == "probe") continue;
    check_failed(program.run(words), 3, words, {"does not build"});
    BOOST_TEST(joined(files_below(folder.path())) == "");
  }
}

BOOST_AUTO_TEST_CASE(device_that_refuses_memory_or_is_lost_leaves_no_output) {
  const TemporaryFolder folder, streams;
  Program program(streams.path());
  program.environment["LD_PRELOAD"] = VDVR_OPENCL_SHIM;
  int failed = 0;
  for (const char* fault : {"VDVR_SHIM_BUFFER_FAILS", "VDVR_SHIM_LAUNCH_FAILS"})
    for (const char* from : {"1", "4", "12"}) {
      program.environment[fault] = from;
      for (const Words& words : writers((folder / "o").string())) {
        if (words[0] == "simulate" || words[0] == "export" || words[0] == "probe") continue;
        const Ended r = program.run(words);
        if (r.code == 0) {  // it needed fewer calls than that
          for (const auto& entry : fs::directory_iterator(folder.path())) fs::remove_all(entry.path());
          continue;
        }
        ++failed;
        check_failed(r, 3, words, {"CL_", "memory"});
        const auto left = files_below(folder.path());
        BOOST_TEST(std::all_of(left.begin(), left.end(),
                               [](const std::string& name) { return name.ends_with(".journal"); }),
                   words[0] << " left " << joined(left));
        for (const auto& entry : fs::directory_iterator(folder.path())) fs::remove_all(entry.path());
      }
      program.environment.erase(fault);
    }
  BOOST_TEST(failed >= 12);
}

BOOST_AUTO_TEST_CASE(device_that_cannot_be_described_ends_no_listing_and_is_named) {
  const TemporaryFolder folder, streams;
  Program program(streams.path());
  program.environment["LD_PRELOAD"] = VDVR_OPENCL_FAULTS;
  for (const char* call : {"clGetDeviceIDs:1", "clGetDeviceInfo:3", "clCreateContext:1"}) {
    program.environment["VDVR_FAULTS_FAIL"] = call;
    const Ended listed = program.run({"devices"});
    BOOST_TEST(listed.code == 0, call << ": " << listed.err);
  }
  program.environment["VDVR_FAULTS_FAIL"] = "clGetDeviceInfo:3";
  const Words words{"render", inputs().volume, "--size", "64x64", "-o", (folder / "o.png").string()};
  check_failed(program.run(words), 3, words, {"cannot be used: clGetDeviceInfo"});
  BOOST_TEST(joined(files_below(folder.path())) == "");
}

BOOST_AUTO_TEST_CASE(device_with_small_limits_gives_a_certified_volume_or_names_the_limit) {
  const TemporaryFolder folder, streams;
  const fs::path out = folder / "o.vdvr";
  const std::string hash = content_sha256(read_vdvr(inputs().volume).volume);
  struct Limit {
    const char *name, *value;
  };
  int whole = 0;
  for (const Limit& limit : {Limit{"VDVR_SHIM_MAX_ALLOC", "1000000"}, Limit{"VDVR_SHIM_MAX_ALLOC", "10000"},
                             Limit{"VDVR_SHIM_GLOBAL_MEM", "4000000"}, Limit{"VDVR_SHIM_GLOBAL_MEM", "1000"},
                             Limit{"VDVR_SHIM_IMAGES", "0"}, Limit{"VDVR_SHIM_IMAGE3D", "8"}}) {
    Program program(streams.path());
    program.environment = {{"LD_PRELOAD", VDVR_OPENCL_SHIM}, {limit.name, limit.value}};
    for (const Words& words :
         {Words{"build", inputs().scan, "--epsilon", "5%", "-o", out.string()},
          Words{"render", inputs().volume, "--size", "64x64", "-o", (folder / "o.png").string()}}) {
      const Ended r = program.run(words);
      BOOST_TEST_CONTEXT(limit.name << "=" << limit.value) {
        if (r.code != 0)
          check_failed(r, 3, words, {"--max-memory", "--granularity", "--device", "--sampler"});
        else ++whole;
        if (r.code == 0 && words[0] == "build") {
          // Without images their sampler takes no share of the tolerance: the volume is another, as good.
          const VdvrFile built = read_vdvr(out);
          const bool images = std::string(limit.name).find("IMAGE") == std::string::npos;
          if (images) BOOST_TEST(content_sha256(built.volume) == hash);
          else BOOST_TEST(!built.certificate.holds_image3d);
          BOOST_TEST(built.certificate.holds_buffer);
        }
      }
      if (r.code != 0) BOOST_TEST(!fs::exists(words.back()));
      fs::remove(words.back());
    }
  }
  BOOST_TEST(whole >= 4);  // without images, and with small ones, everything works
}
