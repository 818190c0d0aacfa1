// Files that appear whole, or not at all, whatever ends the work.
#define BOOST_TEST_MODULE output_file
#include <boost/test/unit_test.hpp>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/stop.hpp"

namespace fs = std::filesystem;
using namespace vdvr;
using vdvr::support::TemporaryFolder;

namespace {

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// A wish to stop, as a signal's handler leaves it.
struct Asked {
  Asked() { request_stop(130); }
  ~Asked() { request_stop(0); }
};

}  // namespace

BOOST_AUTO_TEST_CASE(files_that_belong_together_appear_together) {
  const TemporaryFolder folder;
  {
    io::AtomicFiles files;
    io::write_file(files.add(folder / "a"), "1");
    io::write_file(files.add(folder / "b"), "2");
    for (const std::string& name : names_in(folder.path())) BOOST_TEST(name.front() == '.');
    files.commit();
  }
  BOOST_TEST((names_in(folder.path()) == std::set<std::string>{"a", "b"}));
  BOOST_TEST(text_of(folder / "b") == "2");
}

BOOST_AUTO_TEST_CASE(what_is_not_committed_leaves_nothing) {
  const TemporaryFolder folder;
  {
    io::AtomicFiles files;
    io::write_file(files.add(folder / "a"), "1");
    static_cast<void>(files.add(folder / "b"));
  }
  BOOST_TEST(names_in(folder.path()).empty());
}

BOOST_AUTO_TEST_CASE(nothing_appears_once_a_stop_was_requested) {
  const TemporaryFolder folder;
  io::write_file(folder / "a", "old");
  fs::create_directory(folder / "d");
  io::write_file(folder / "d" / "part", "old");
  {
    io::AtomicFiles files;
    io::write_file(files.add(folder / "a"), "new");
    io::write_file(files.add(folder / "b"), "new");
    io::AtomicFolder whole(folder / "d");
    io::AtomicFile file(folder / "c");
    const Asked asked;
    BOOST_CHECK_THROW(files.commit(), Interrupted);
    BOOST_CHECK_THROW(whole.commit(), Interrupted);
    BOOST_CHECK_THROW(file.commit(), Interrupted);
  }
  BOOST_TEST((names_in(folder.path()) == std::set<std::string>{"a", "d"}));
  BOOST_TEST(text_of(folder / "a") == "old");
  BOOST_TEST(text_of(folder / "d" / "part") == "old");
}

BOOST_AUTO_TEST_CASE(a_program_that_ends_without_unwinding_leaves_none_of_them) {
  const TemporaryFolder folder;
  io::AtomicFiles files;
  io::write_file(files.add(folder / "a"), "1");
  io::write_file(files.add(folder / "b"), "2");
  io::remove_temporaries();
  BOOST_TEST(names_in(folder.path()).empty());
}

// A folder of ours and the journal in it, as `run` has them in its first minutes.
BOOST_AUTO_TEST_CASE(a_folder_goes_after_what_lies_in_it) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "out");
  io::note_temporary(folder / "out");
  io::write_file(folder / "out" / "volume.vdvr.journal", "");
  io::note_temporary(folder / "out" / "volume.vdvr.journal");
  io::remove_temporaries();
  BOOST_TEST(names_in(folder.path()).empty());
}
