#include "apps/mpi/mpi_messenger.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "vdvr/error.hpp"
#include "vdvr/expert/scratch.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::cli {
namespace {

using Clock = std::chrono::steady_clock;

enum Tag { words = 1, file_here = 2, file_part = 3, file_mapped = 4, common_here = 5, common_open = 6 };

constexpr std::uint64_t most_on_its_way = std::uint64_t{64} << 20, file_part_bytes = std::uint64_t{16} << 20;
constexpr std::chrono::microseconds pause{500};
constexpr std::chrono::seconds longest_send{120}, longest_flush{10}, longest_wait_for_common{10};

struct Header {
  std::uint64_t number = 0, bytes = 0;
};

std::vector<std::byte> with_header(const Header& header, std::span<const std::byte> rest) {
  std::vector<std::byte> out;
  out.reserve(sizeof header + rest.size());
  for (const std::byte b : std::as_bytes(std::span(&header, 1))) out.push_back(b);
  for (const std::byte b : rest) out.push_back(b);
  return out;
}

Header header_of(const std::vector<std::byte>& message) {
  Header header;
  if (message.size() < sizeof header) throw ResourceError("a message of another rank is too short");
  std::memcpy(&header, message.data(), sizeof header);
  return header;
}

// Tests only: ranks dealt out to so many machines that are all this one.
int pretended_machines() {
  const char* text = std::getenv("VDVR_MPI_PRETEND_MACHINES");
  return text == nullptr ? 0 : std::max(0, std::atoi(text));
}

void write_all(const std::filesystem::path& path, std::uint64_t offset, std::span<const std::byte> bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  int error = file < 0 ? errno : 0;
  while (error == 0 && !bytes.empty()) {
    const ssize_t n = ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      error = n < 0 ? errno : ENOSPC;
      break;
    }
    offset += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  if (file >= 0) ::close(file);
  if (error != 0)
    throw ResourceError(
        fmt::format("{}: the projections for ranks of this machine cannot be written: {}; set "
                    "TMPDIR to a folder with room",
                    path.string(), std::strerror(error)));
}

}  // namespace

MpiMessenger::MpiMessenger() {
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  MPI_Comm machine = MPI_COMM_NULL;
  if (const int pretended = pretended_machines(); pretended > 0)
    MPI_Comm_split(MPI_COMM_WORLD, rank_ % pretended, rank_, &machine);
  else MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &machine);
  int here = 1;
  MPI_Comm_size(machine, &here);
  MPI_Comm_rank(machine, &place_);
  machine_.resize(static_cast<std::size_t>(here));
  MPI_Allgather(&rank_, 1, MPI_INT, machine_.data(), 1, MPI_INT, machine);
  MPI_Comm_free(&machine);
  heads_.resize(static_cast<std::size_t>(size_));
  const int head = machine_.front();
  MPI_Allgather(&head, 1, MPI_INT, heads_.data(), 1, MPI_INT, MPI_COMM_WORLD);
  states_.assign(static_cast<std::size_t>(size_), State::here);
  // From here on a rank that fails is an answer, where MPI goes on without it.
  MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
}

MpiMessenger::~MpiMessenger() {
  std::error_code ignored;
  for (const auto& [number, file] : files_)
    if (file.own) std::filesystem::remove(file.path, ignored);
  for (const auto& [number, common] : commons_)
    if (common.file >= 0) ::close(common.file);
}

bool MpiMessenger::is_gone(int process) const {
  return states_[static_cast<std::size_t>(process)] == State::gone;
}

void MpiMessenger::give_up(int process) {
  State& state = states_[static_cast<std::size_t>(process)];
  if (state == State::here) state = State::given_up;
}

bool MpiMessenger::lost_any() const {
  return std::any_of(states_.begin(), states_.end(), [](State s) { return s != State::here; });
}

std::uint64_t MpiMessenger::on_its_way(int to) const {
  std::uint64_t bytes = 0;
  for (const Sending& s : sending_)
    if (s.to == to) bytes += s.bytes.size();
  return bytes;
}

// Lets go of what has been sent.
void MpiMessenger::progress() {
  for (auto s = sending_.begin(); s != sending_.end();) {
    int done = 0;
    if (states_[static_cast<std::size_t>(s->to)] == State::here &&
        MPI_Test(&s->request, &done, MPI_STATUS_IGNORE) != MPI_SUCCESS) {
      states_[static_cast<std::size_t>(s->to)] = State::gone;
      done = 1;
    }
    s = done != 0 ? sending_.erase(s) : std::next(s);
  }
}

void MpiMessenger::post(int to, int tag, std::vector<std::byte> bytes) {
  if (states_[static_cast<std::size_t>(to)] != State::here) return;
  if (bytes.size() > INT_MAX)
    throw ResourceError(fmt::format("a message of {} bytes is too long for MPI", bytes.size()));
  Sending& s = sending_.emplace_back(Sending{to, std::move(bytes), MPI_REQUEST_NULL});
  if (MPI_Isend(s.bytes.data(), static_cast<int>(s.bytes.size()), MPI_BYTE, to, tag, MPI_COMM_WORLD,
                &s.request) == MPI_SUCCESS)
    return;
  states_[static_cast<std::size_t>(to)] = State::gone;
  sending_.pop_back();
}

void MpiMessenger::send(int to, std::vector<std::byte> message) {
  progress();
  const auto start = Clock::now();
  while (states_[static_cast<std::size_t>(to)] == State::here &&
         on_its_way(to) + message.size() > most_on_its_way && on_its_way(to) > 0) {
    throw_if_stopped();
    if (Clock::now() - start > longest_send) states_[static_cast<std::size_t>(to)] = State::gone;
    hear_of_files();
    std::this_thread::sleep_for(pause);
    progress();
  }
  post(to, words, std::move(message));
}

// Rank by rank: asked for any, MPI answers nothing but an error once one has failed.
bool MpiMessenger::take(int tag, int& from, std::vector<std::byte>& bytes) {
  for (int i = 0; i < size_; ++i) {
    const int rank = (next_ + i) % size_;
    if (rank == rank_ || states_[static_cast<std::size_t>(rank)] != State::here) continue;
    int found = 0, count = 0;
    MPI_Message message = MPI_MESSAGE_NULL;
    MPI_Status status;
    if (MPI_Improbe(rank, tag, MPI_COMM_WORLD, &found, &message, &status) != MPI_SUCCESS) {
      states_[static_cast<std::size_t>(rank)] = State::gone;
      continue;
    }
    if (found == 0) continue;
    MPI_Get_count(&status, MPI_BYTE, &count);
    bytes.resize(static_cast<std::size_t>(count));
    if (MPI_Mrecv(bytes.data(), count, MPI_BYTE, &message, &status) != MPI_SUCCESS) {
      states_[static_cast<std::size_t>(rank)] = State::gone;
      continue;
    }
    from = rank;
    next_ = rank + 1;
    return true;
  }
  return false;
}

std::optional<std::pair<int, std::vector<std::byte>>> MpiMessenger::receive(std::chrono::milliseconds wait) {
  const auto start = Clock::now();
  for (;;) {
    progress();
    hear_of_files();
    std::pair<int, std::vector<std::byte>> message;
    if (take(words, message.first, message.second)) return message;
    if (rank_ != 0 && states_[0] != State::here) throw ResourceError("the rank that leads has ended");
    if (Clock::now() - start >= wait) return std::nullopt;
    std::this_thread::sleep_for(pause);
  }
}

// --- what a machine has once ---

std::vector<int> MpiMessenger::neighbours_of_mine() const {
  std::vector<int> out;
  for (const int rank : machine_)
    if (rank != rank_) out.push_back(rank);
  return out;
}

MpiMessenger::File& MpiMessenger::new_file(std::uint64_t number, std::uint64_t bytes) {
  File& file = files_[number];
  file.path = default_scratch_folder() / fmt::format(".vdvr-mpi.{}.{}.{}", ::getpid(), rank_, number);
  file.bytes = bytes;
  file.own = true;
  std::error_code ignored;
  std::filesystem::remove(file.path, ignored);  // of a process that was killed
  return file;
}

// To the ranks of this machine: the file is whole.
void MpiMessenger::announce(std::uint64_t number) {
  File& file = files_.at(number);
  file.whole = true;
  const std::string path = file.path.string();
  for (const int rank : neighbours_of_mine()) {
    ++file.unmapped;
    post(rank, file_here,
         with_header({number, file.bytes}, std::as_bytes(std::span(path.data(), path.size()))));
  }
}

void MpiMessenger::hear_of_files() {
  int from = 0;
  std::vector<std::byte> bytes;
  while (take(file_here, from, bytes)) {
    const Header header = header_of(bytes);
    File& file = files_[header.number];
    file.path = std::string(reinterpret_cast<const char*>(bytes.data()) + sizeof header,
                            bytes.size() - sizeof header);
    file.bytes = header.bytes;
    file.whole = true;
  }
  while (take(file_part, from, bytes)) {
    const Header header = header_of(bytes);
    File& file =
        files_.contains(header.number) ? files_.at(header.number) : new_file(header.number, header.bytes);
    const auto part = std::span<const std::byte>(bytes).subspan(sizeof header);
    write_all(file.path, file.written, part);
    file.written += part.size();
    if (file.written == file.bytes) announce(header.number);
  }
  hear_of_commons();
  while (take(file_mapped, from, bytes)) {
    const auto found = files_.find(header_of(bytes).number);
    if (found == files_.end() || !found->second.own || --found->second.unmapped > 0) continue;
    std::error_code ignored;
    std::filesystem::remove(found->second.path, ignored);
    found->second.own = false;
  }
}

std::uint64_t MpiMessenger::lend(std::span<const std::byte> bytes) {
  const std::uint64_t number = ++lent_;
  std::vector<int> heads;
  for (int rank = 0; rank < size_; ++rank) {
    const int head = heads_[static_cast<std::size_t>(rank)];
    if (head == rank && head != rank_) heads.push_back(head);
  }
  if (machine_.size() > 1) {
    write_all(new_file(number, bytes.size()).path, 0, bytes);
    announce(number);
  }
  for (std::uint64_t at = 0; at < bytes.size(); at += file_part_bytes) {
    const auto part = bytes.subspan(at, std::min<std::uint64_t>(file_part_bytes, bytes.size() - at));
    for (const int head : heads) {
      while (states_[static_cast<std::size_t>(head)] == State::here && on_its_way(head) > most_on_its_way) {
        throw_if_stopped();
        std::this_thread::sleep_for(pause);
        progress();
      }
      post(head, file_part, with_header({number, bytes.size()}, part));
    }
  }
  return number;
}

std::pair<std::span<const std::byte>, std::shared_ptr<const void>> MpiMessenger::lent(std::uint64_t number) {
  while (!files_.contains(number) || !files_.at(number).whole) {
    throw_if_stopped();
    progress();
    hear_of_files();
    if (states_[0] != State::here) throw ResourceError("the rank that leads has ended");
    std::this_thread::sleep_for(pause);
  }
  File& file = files_.at(number);
  const int fd = ::open(file.path.c_str(), O_RDONLY | O_CLOEXEC);
  void* first = fd < 0 ? MAP_FAILED : ::mmap(nullptr, file.bytes, PROT_READ, MAP_SHARED, fd, 0);
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (first == MAP_FAILED)
    throw ResourceError(fmt::format("{}: the projections of this machine cannot be mapped: {}",
                                    file.path.string(), std::strerror(error)));
  const std::uint64_t bytes = file.bytes;
  if (!file.own) post(machine_.front(), file_mapped, with_header({number, 0}, {}));
  if (file.own && file.unmapped == 0) {
    std::error_code ignored;
    std::filesystem::remove(file.path, ignored);
  }
  return {
      {static_cast<const std::byte*>(first), bytes},
      std::shared_ptr<const void>(first, [bytes](const void* p) { ::munmap(const_cast<void*>(p), bytes); })};
}

void MpiMessenger::hear_of_commons() {
  int from = 0;
  std::vector<std::byte> bytes;
  while (take(common_here, from, bytes)) {
    const Header header = header_of(bytes);
    commons_[header.number] = {-1, 0,
                               std::string(reinterpret_cast<const char*>(bytes.data()) + sizeof header,
                                           bytes.size() - sizeof header),
                               header.bytes};
  }
  while (take(common_open, from, bytes)) {
    const auto found = commons_.find(header_of(bytes).number);
    if (found == commons_.end() || --found->second.unopened > 0 || found->second.file < 0) continue;
    ::close(std::exchange(found->second.file, -1));
  }
}

CommonMemory MpiMessenger::common(std::uint64_t number, std::uint64_t bytes) {
  int file = -1;
  if (place_ == 0) {
    file = ::memfd_create("vdvr-mpi", MFD_CLOEXEC);
    if (file < 0 || ::ftruncate(file, static_cast<off_t>(bytes)) != 0) {
      if (file >= 0) ::close(file);
      return {};
    }
    const std::string path = fmt::format("/proc/{}/fd/{}", ::getpid(), file);
    Common& own = commons_[number] = {file, 0, path, bytes};
    for (const int rank : neighbours_of_mine()) {
      ++own.unopened;
      post(rank, common_here,
           with_header({number, bytes}, std::as_bytes(std::span(path.data(), path.size()))));
    }
  } else {
    const auto start = Clock::now();
    while (!commons_.contains(number)) {
      throw_if_stopped();
      if (states_[0] != State::here) throw ResourceError("the rank that leads has ended");
      if (Clock::now() - start > longest_wait_for_common) return {};
      std::this_thread::sleep_for(pause);
      progress();
      hear_of_commons();
    }
    const Common& other = commons_.at(number);
    file = other.bytes < bytes ? -1 : ::open(other.path.c_str(), O_RDWR | O_CLOEXEC);
    bytes = other.bytes;
  }
  void* first = file < 0 ? MAP_FAILED : ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (place_ != 0) {
    if (file >= 0) ::close(file);
    post(machine_.front(), common_open, with_header({number, 0}, {}));
  }
  if (first == MAP_FAILED) return {};
  return {{static_cast<std::byte*>(first), bytes},
          std::shared_ptr<void>(first, [bytes](void* p) { ::munmap(p, bytes); }),
          neighbours()};
}

bool MpiMessenger::part(std::optional<std::chrono::milliseconds> patience) {
  MPI_Request all = MPI_REQUEST_NULL;
  if (lost_any() || MPI_Ibarrier(MPI_COMM_WORLD, &all) != MPI_SUCCESS) return false;
  const auto start = Clock::now();
  for (int here = 0, more = 1; here == 0 || more != 0;) {
    more = 0;
    int from = 0;
    std::vector<std::byte> bytes;
    while (take(words, from, bytes)) more = 1;
    hear_of_files();
    progress();
    if (here == 0 && MPI_Test(&all, &here, MPI_STATUS_IGNORE) != MPI_SUCCESS) return false;
    if (here == 0 && patience && Clock::now() - start > *patience) return false;
    std::this_thread::sleep_for(pause);
  }
  return true;
}

void MpiMessenger::flush() {
  const auto start = Clock::now();
  while (!sending_.empty() && Clock::now() - start < longest_flush) {
    progress();
    hear_of_files();
    std::erase_if(sending_, [&](const Sending& s) {
      return states_[static_cast<std::size_t>(s.to)] != State::here && s.request == MPI_REQUEST_NULL;
    });
    if (std::all_of(sending_.begin(), sending_.end(),
                    [&](const Sending& s) { return states_[static_cast<std::size_t>(s.to)] != State::here; }))
      return;
    std::this_thread::sleep_for(pause);
  }
}

}  // namespace vdvr::cli
