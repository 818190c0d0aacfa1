// One reading of one file of any bytes, for libFuzzer and for mutate.cpp alike.
#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "tests/fuzz/target.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"

// A size that a damaged file claims makes malloc fail, as it does without the sanitizer.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() {
  return "allocator_may_return_null=1:detect_leaks=0:quarantine_size_mb=32";
}

namespace vdvr::fuzz {

Verdict judge(const std::filesystem::path& folder, const std::uint8_t* bytes, std::size_t size,
              std::string& why) {
  const auto path = folder / fuzz_target.file_name;
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0 || ::write(file, bytes, size) != static_cast<ssize_t>(size)) {
    why = "the mutant cannot be written to " + path.string();
    return Verdict::wrong;
  }
  ::close(file);
  try {
    fuzz_target.read(path);
    return Verdict::read;
  } catch (const Error& e) {
    why = e.what();
    if (why.find(folder.string()) == std::string::npos) {
      why = "the message does not name the file: " + why;
      return Verdict::wrong;
    }
    if (e.kind() == ErrorKind::input || e.kind() == ErrorKind::file) return Verdict::refused;
    if (e.kind() == ErrorKind::mismatch || e.kind() == ErrorKind::tolerance) return Verdict::mismatch;
    if (why.find("limit") != std::string::npos) return Verdict::beyond_limit;
    why = "kind " + std::to_string(static_cast<int>(e.kind())) + ": " + why;
    return Verdict::wrong;
  } catch (const std::exception& e) {
    why = std::string("an exception that is not ours: ") + e.what();
    return Verdict::wrong;
  }
}

}  // namespace vdvr::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const vdvr::support::TemporaryFolder folder;
  static const auto seeds = vdvr::fuzz::fuzz_target.seeds(folder.path());  // leaves what lies beside the file
  std::string why;
  if (vdvr::fuzz::judge(folder.path(), bytes, size, why) == vdvr::fuzz::Verdict::wrong) {
    std::fprintf(stderr, "%s\n", why.c_str());
    std::abort();
  }
  return 0;
}
