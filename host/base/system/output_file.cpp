// Whole-or-nothing output files.
#include "vdvr/expert/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>
#include <vector>

#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::io {
namespace {

std::filesystem::path folder_of(const std::filesystem::path& target) {
  return target.has_parent_path() ? target.parent_path() : std::filesystem::path(".");
}

/// `flush`: fsync, or syncfs of all that was written to the path's disk.
void sync_path(const std::filesystem::path& path, int flags, int (*flush)(int) = ::fsync) {
  const int fd = ::open(path.c_str(), flags);
  if (fd < 0) return;  // a file system that cannot be synced still renames atomically
  const int failed = flush(fd);
  const int why = errno;
  ::close(fd);
  if (failed != 0 && (why == ENOSPC || why == EDQUOT || why == EIO))
    throw ResourceError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(why)));
}

struct Temporaries {
  std::mutex lock;
  std::set<std::filesystem::path> paths, trees;
};
Temporaries& temporaries() {
  static Temporaries all;
  return all;
}

// What a program that ends without unwinding waits for in remove_temporaries: it finds either nothing in
// place, or all of it. The wish to stop is looked for here once more: what comes after it is work done.
class Placing {
 public:
  Placing() : guard_(temporaries().lock) { throw_if_stopped(); }

 private:
  std::lock_guard<std::mutex> guard_;
};

/// A name in the folder of `target` under which `make` has made something.
template <class Make>
std::string made_beside(const std::filesystem::path& target, const Make& make) {
  const auto folder = folder_of(target);
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    throw FileError(fmt::format("{}: folder '{}' does not exist", target.string(), folder.string()));
  std::string name = (folder / ("." + target.filename().string() + ".XXXXXX")).string();
  if (make(name.data())) return name;
  const int why = errno;
  if (why == ENOSPC) throw ResourceError(fmt::format("{}: disk full", target.string()));
  throw FileError(
      fmt::format("{}: cannot write into '{}': {}", target.string(), folder.string(), std::strerror(why)));
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path target) : target_(std::move(target)) {
  int fd = -1;
  temporary_ = made_beside(target_, [&](char* name) { return (fd = ::mkstemp(name)) >= 0; });
  ::fchmod(fd, 0644);
  ::close(fd);
  note_temporary(temporary_);
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (committed_) return;
  std::filesystem::remove(temporary_, ignored);
  forget_temporary(temporary_);
}

void AtomicFile::commit() {
  sync_path(temporary_, O_RDONLY);
  {
    const Placing placing;
    put_in_place();
  }
  sync_path(folder_of(target_), O_RDONLY | O_DIRECTORY);
}

// While Placing.
void AtomicFile::put_in_place() {
  std::error_code error;
  std::filesystem::rename(temporary_, target_, error);
  if (error)
    throw ResourceError(fmt::format("{}: cannot be put in place: {}", target_.string(), error.message()));
  committed_ = true;
  temporaries().paths.erase(temporary_);
}

const std::filesystem::path& AtomicFiles::add(const std::filesystem::path& target) {
  return files_.emplace_back(target).temporary();
}

void AtomicFiles::commit() {
  for (const AtomicFile& file : files_) sync_path(file.temporary_, O_RDONLY);
  {
    const Placing placing;
    for (AtomicFile& file : files_) file.put_in_place();
  }
  for (const AtomicFile& file : files_) sync_path(folder_of(file.target_), O_RDONLY | O_DIRECTORY);
}

namespace {

/// A new folder beside `target`, noted as temporary.
std::filesystem::path folder_beside(const std::filesystem::path& target) {
  std::string name = made_beside(target, [](char* folder) { return ::mkdtemp(folder) != nullptr; });
  ::chmod(name.c_str(), 0755);
  Temporaries& all = temporaries();
  const std::lock_guard guard(all.lock);
  all.trees.insert(name);
  return name;
}

void forget_tree(const std::filesystem::path& path) {
  Temporaries& all = temporaries();
  const std::lock_guard guard(all.lock);
  all.trees.erase(path);
}

void remove_tree(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::remove_all(path, ignored);
  forget_tree(path);
}

// Goes where it ends if nothing lies in it.
struct EmptyFolder {
  explicit EmptyFolder(std::filesystem::path made) : path(std::move(made)) {}
  ~EmptyFolder() {
    std::error_code ignored;
    if (!path.empty()) std::filesystem::remove(path, ignored);
    forget_tree(path);
  }
  EmptyFolder(const EmptyFolder&) = delete;
  EmptyFolder& operator=(const EmptyFolder&) = delete;
  std::filesystem::path path;
};

}  // namespace

AtomicFolder::AtomicFolder(std::filesystem::path target) : target_(std::move(target)) {
  if (!target_.has_filename()) target_ = target_.parent_path();  // "slices/"
  temporary_ = folder_beside(target_);
}

AtomicFolder::~AtomicFolder() {
  if (!committed_) remove_tree(temporary_);
}

void AtomicFolder::commit() {
  sync_path(temporary_, O_RDONLY | O_DIRECTORY, ::syncfs);  // one call for thousands of small files
  std::error_code ignored;
  const bool replaces = std::filesystem::exists(target_, ignored);
  const EmptyFolder aside(replaces ? folder_beside(target_) : std::filesystem::path());
  {
    const Placing placing;
    put_in_place(aside.path);
  }
  if (replaces) remove_tree(aside.path);
  sync_path(folder_of(target_), O_RDONLY | O_DIRECTORY);
}

// While Placing. A folder is renamed over an empty one only: what was there steps aside first, and goes last.
void AtomicFolder::put_in_place(const std::filesystem::path& aside) {
  temporaries().trees.erase(aside);  // what will lie there is the user's until the new one is in place
  std::error_code error;
  if (!aside.empty()) std::filesystem::rename(target_, aside, error);
  if (!error) std::filesystem::rename(temporary_, target_, error);
  if (error) {
    std::error_code ignored;
    if (!aside.empty() && !std::filesystem::exists(target_, ignored))
      std::filesystem::rename(aside, target_, ignored);
    throw ResourceError(fmt::format("{}: cannot be put in place: {}", target_.string(), error.message()));
  }
  committed_ = true;
  temporaries().trees.erase(temporary_);
}

void note_temporary(const std::filesystem::path& path) {
  Temporaries& all = temporaries();
  const std::lock_guard guard(all.lock);
  all.paths.insert(path);
}

void forget_temporary(const std::filesystem::path& path) {
  Temporaries& all = temporaries();
  const std::lock_guard guard(all.lock);
  all.paths.erase(path);
}

void remove_temporaries() {
  Temporaries& all = temporaries();
  const std::lock_guard guard(all.lock);
  std::error_code ignored;
  for (const auto& path : all.trees) std::filesystem::remove_all(path, ignored);
  // Backwards: what lies in a folder comes after it, and must go before it.
  for (auto path = all.paths.rbegin(); path != all.paths.rend(); ++path)
    std::filesystem::remove(*path, ignored);
  all.trees.clear();
  all.paths.clear();
}

void remove_leftovers(const std::filesystem::path& target) {
  constexpr std::size_t random_letters = 6;  // mkstemp's
  const std::string start = "." + target.filename().string() + ".";
  std::error_code ignored;
  std::vector<std::filesystem::path> found;
  for (std::filesystem::directory_iterator entry(folder_of(target), ignored), end; entry != end;
       entry.increment(ignored)) {
    const std::string name = entry->path().filename().string();
    if (name.size() == start.size() + random_letters && name.starts_with(start) &&
        entry->is_regular_file(ignored))
      found.push_back(entry->path());
  }
  for (const auto& path : found) std::filesystem::remove(path, ignored);
}

void write_file(const std::filesystem::path& path, const std::string& bytes) {
  AtomicFile file(path);
  const int fd = ::open(file.temporary().c_str(), O_WRONLY | O_TRUNC);
  if (fd < 0) throw FileError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0) {
      const std::string why = std::strerror(errno);
      ::close(fd);
      throw ResourceError(fmt::format("{}: write failed after {} bytes: {}", path.string(), done, why));
    }
    done += static_cast<std::size_t>(n);
  }
  ::close(fd);
  file.commit();
}

}  // namespace vdvr::io
