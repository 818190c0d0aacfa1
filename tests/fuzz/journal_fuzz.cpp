// The journal of an unfinished build: what comes back is a prefix of what was written.
#include <algorithm>
#include <cstring>

#include "tests/fuzz/target.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/journal.hpp"

namespace vdvr::fuzz {
namespace {

const JournalHead head{{"epsilon", "0.03"}, {"input", "abc"}};

std::vector<std::byte> record(std::size_t i) { return std::vector<std::byte>(1 + 37 * i, std::byte(i)); }

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  const auto path = folder / "seed.journal";
  std::vector<std::string> all;
  for (const std::size_t count : {1u, 8u}) {
    {
      Journal journal(path, false);
      journal.begin(head);
      for (std::size_t i = 0; i < count; ++i) journal.append(record(i));
    }
    all.push_back(support::bytes_of(path));
  }
  return all;
}

void read(const std::filesystem::path& file) {
  Journal journal(file, true);
  journal.begin(head);
  for (std::size_t i = 0;; ++i) {
    const auto found = journal.next();
    if (!found) break;
    if (*found != record(i)) throw std::logic_error("a damaged record was taken for a whole one");
  }
  journal.append(record(9));
}

}  // namespace

const Target fuzz_target{"build.journal", Contents::binary, seeds, read};

}  // namespace vdvr::fuzz
