#define BOOST_TEST_MODULE journal
#include "vdvr/expert/journal.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/test/unit_test.hpp>
#include <csignal>
#include <cstring>
#include <fstream>

#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"

using vdvr::Journal;
using vdvr::JournalHead;
using vdvr::support::bytes_of;
using vdvr::support::TemporaryFolder;

namespace {

const JournalHead kHead{{"epsilon", "0.03"}, {"input", "abc"}};

std::vector<std::byte> record(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

const std::vector<std::string> kRecords{"one", "", "three is longer", "4"};

void write_journal(const std::filesystem::path& path) {
  Journal journal(path, false);
  journal.begin(kHead);
  for (const auto& r : kRecords) journal.append(record(r));
}

// What a resume finds; afterwards it appends `more`.
std::vector<std::string> resume(const std::filesystem::path& path, const std::string& more = "more") {
  Journal journal(path, true);
  journal.begin(kHead);
  std::vector<std::string> found;
  while (const auto r = journal.next())
    found.emplace_back(reinterpret_cast<const char*>(r->data()), r->size());
  BOOST_TEST(journal.replayed() == static_cast<std::int64_t>(found.size()));
  journal.append(record(more));
  return found;
}

bool is_prefix(const std::vector<std::string>& found) {
  return found.size() <= kRecords.size() && std::equal(found.begin(), found.end(), kRecords.begin());
}

void overwrite(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

bool refused(const std::filesystem::path& path, bool with_resume, const JournalHead& head,
             const std::string& named) {
  try {
    Journal journal(path, with_resume);
    journal.begin(head);
  } catch (const vdvr::InputError& e) {
    BOOST_TEST(std::string(e.what()).find(named) != std::string::npos, e.what());
    BOOST_TEST(std::string(e.what()).find(path.string()) != std::string::npos, e.what());
    return true;
  }
  return false;
}

}  // namespace

BOOST_AUTO_TEST_CASE(records_come_back_in_order_and_more_may_follow) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  write_journal(path);
  BOOST_TEST(resume(path) == kRecords, boost::test_tools::per_element());
  auto more = kRecords;
  more.emplace_back("more");
  BOOST_TEST(resume(path) == more, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(journal_torn_at_any_byte_gives_its_whole_records) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  write_journal(path);
  const std::string whole = bytes_of(path);
  std::size_t found_before = 0;
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    overwrite(path, whole.substr(0, length));
    const auto found = resume(path);
    BOOST_TEST(is_prefix(found));
    BOOST_TEST(found.size() >= found_before);
    found_before = found.size();
    // What was appended after the cut is read behind it.
    BOOST_TEST(resume(path).back() == "more");
  }
  BOOST_TEST(found_before == kRecords.size());
}

BOOST_AUTO_TEST_CASE(flipped_bit_anywhere_ends_the_journal_there) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  write_journal(path);
  const std::string whole = bytes_of(path);
  for (std::size_t i = 8; i < whole.size(); ++i)
    for (int bit = 0; bit < 8; ++bit) {
      std::string altered = whole;
      altered[i] = static_cast<char>(altered[i] ^ (1 << bit));
      overwrite(path, altered);
      const auto found = resume(path);
      BOOST_TEST((is_prefix(found) && found.size() < kRecords.size()));
    }
}

BOOST_AUTO_TEST_CASE(zeros_behind_the_last_record_are_no_records) {
  const TemporaryFolder folder;
  const auto path = folder / "a.journal";
  write_journal(path);
  overwrite(path, bytes_of(path) + std::string(4096, '\0'));
  BOOST_TEST((resume(path) == kRecords));
}

BOOST_AUTO_TEST_CASE(records_in_another_order_are_not_taken) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  Journal(path, false).begin(kHead);  // removed again: no record in it
  {
    Journal journal(path, false);
    journal.begin(kHead);
    journal.append(record("aaaa"));
    journal.append(record("bbbb"));
  }
  std::string bytes = bytes_of(path);
  const std::size_t one = 4 + 8 + 4;
  const std::string last = bytes.substr(bytes.size() - one),
                    before = bytes.substr(bytes.size() - 2 * one, one);
  overwrite(path, bytes.substr(0, bytes.size() - 2 * one) + last + before);
  BOOST_TEST(resume(path).empty());
}

BOOST_AUTO_TEST_CASE(foreign_files_and_heads_are_refused_by_name) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  write_journal(path);
  const std::string whole = bytes_of(path);
  BOOST_TEST(refused(path, true, {{"epsilon", "0.02"}, {"input", "abc"}}, "epsilon was 0.03, is 0.02"));
  BOOST_TEST(refused(path, true, {{"input", "abc"}}, "epsilon was 0.03, is nothing"));
  BOOST_TEST((bytes_of(path) == whole));
  overwrite(path, "not a journal at all");
  BOOST_TEST(refused(path, true, kHead, "no journal"));
  BOOST_TEST(refused(path, false, kHead, "no journal"));
  BOOST_TEST(bytes_of(path) == "not a journal at all");
}

BOOST_AUTO_TEST_CASE(without_resume_a_journal_is_replaced_but_not_before_work_begins) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  write_journal(path);
  const std::string whole = bytes_of(path);
  {
    Journal journal(path, false);
    BOOST_TEST(journal.found());
    BOOST_TEST(!journal.resumes());
  }
  BOOST_TEST((bytes_of(path) == whole));
  {
    Journal journal(path, false);
    journal.begin({{"other", "head"}});
    BOOST_TEST(!journal.next());
    journal.append(record("new"));
  }
  Journal journal(path, true);
  journal.begin({{"other", "head"}});
  BOOST_TEST((journal.next() == record("new")));
  BOOST_TEST(!journal.next());
}

BOOST_AUTO_TEST_CASE(locked_journal_is_refused) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  {
    Journal journal(path, false);
    BOOST_TEST(refused(path, false, kHead, "another process"));
    BOOST_TEST(refused(path, true, kHead, "another process"));
    journal.begin(kHead);
    journal.append(record("kept"));
    BOOST_TEST(refused(path, true, kHead, "another process"));
  }
  BOOST_TEST(resume(path).front() == "kept");
}

BOOST_AUTO_TEST_CASE(journal_without_records_or_of_finished_work_leaves_no_file) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  { Journal journal(path, false); }
  BOOST_TEST(!std::filesystem::exists(path));
  Journal(path, true).begin(kHead);
  BOOST_TEST(!std::filesystem::exists(path));
  write_journal(path);
  Journal(path, true).remove();
  BOOST_TEST(!std::filesystem::exists(path));
  BOOST_CHECK_THROW(Journal(folder / "no folder" / "o.journal", false), vdvr::FileError);
}

// The limit on file sizes stands for a full disk; in a child, as it cannot be taken back.
BOOST_AUTO_TEST_CASE(full_disk_is_named_and_leaves_whole_records) {
  const TemporaryFolder folder;
  const auto path = folder / "o.journal";
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    Journal journal(path, false);
    journal.begin(kHead);
    journal.append(record("small"));
    try {
      journal.append(record(std::string(8192, 'x')));
    } catch (const vdvr::ResourceError& e) {
      ::_exit(std::string(e.what()).find(path.string()) != std::string::npos ? 0 : 1);
    }
    ::_exit(2);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  BOOST_TEST((WIFEXITED(status) && WEXITSTATUS(status) == 0));
  const auto found = resume(path);
  BOOST_REQUIRE(found.size() == 1);
  BOOST_TEST(found[0] == "small");
}
