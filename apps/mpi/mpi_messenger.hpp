// Messages between the ranks of an MPI job, and the projections once for each machine. Called by main.cpp.
#pragma once

#include <mpi.h>

#include <chrono>
#include <filesystem>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/expert/crew.hpp"

namespace vdvr::cli {

/// Sends never wait for a rank to receive, but where much is on its way to it already; receiving polls with
/// pauses, so that a rank that waits leaves its core to others. Ranks that MPI reports as failed are gone; a
/// rank that says nothing is the crew's to give up.
class MpiMessenger final : public Messenger {
 public:
  /// After MPI_Init. Collective.
  MpiMessenger();
  ~MpiMessenger() override;

  [[nodiscard]] int others() const override { return size_ - 1; }
  [[nodiscard]] int place() const override { return place_; }
  [[nodiscard]] int neighbours() const override { return static_cast<int>(machine_.size()); }
  void send(int to, std::vector<std::byte> message) override;
  std::optional<std::pair<int, std::vector<std::byte>>> receive(std::chrono::milliseconds wait) override;
  std::uint64_t lend(std::span<const std::byte> bytes) override;
  std::pair<std::span<const std::byte>, std::shared_ptr<const void>> lent(std::uint64_t number) override;
  CommonMemory common(std::uint64_t number, std::uint64_t bytes) override;
  [[nodiscard]] bool is_gone(int process) const override;
  void give_up(int process) override;

  [[nodiscard]] int rank() const { return rank_; }
  /// Whether any rank is gone or was given up: the others cannot end by MPI_Finalize, which waits for all.
  [[nodiscard]] bool lost_any() const;
  /// Waits for what is on its way, up to some seconds.
  void flush();
  /// Takes what others have sent, and nobody wants any more, until all ranks are here: MPI may complain of
  /// messages that nobody took. Collective, but for ranks that are lost. False where some are not here yet
  /// after `patience`, if there is one.
  [[nodiscard]] bool part(std::optional<std::chrono::milliseconds> patience);

 private:
  enum class State : std::uint8_t { here, gone, given_up };
  struct Sending {
    int to;
    std::vector<std::byte> bytes;
    MPI_Request request;
  };
  // A file that ranks of this machine map, and how many have.
  struct File {
    std::filesystem::path path;
    std::uint64_t bytes = 0, written = 0;
    int unmapped = 0;  // ranks that have not yet
    bool own = false, whole = false;
  };
  // Memory without a name on any disk, which others of this machine open by its number in the first one's
  // process: it vanishes with those who have it.
  struct Common {
    int file = -1;  // of the first one's process, until all have opened it
    int unopened = 0;
    std::string path;
    std::uint64_t bytes = 0;
  };
  void hear_of_commons();
  void post(int to, int tag, std::vector<std::byte> bytes);
  void progress();
  bool take(int tag, int& from, std::vector<std::byte>& bytes);
  void hear_of_files();
  void announce(std::uint64_t number);
  [[nodiscard]] std::uint64_t on_its_way(int to) const;
  [[nodiscard]] std::vector<int> neighbours_of_mine() const;
  File& new_file(std::uint64_t number, std::uint64_t bytes);

  int rank_ = 0, size_ = 1, place_ = 0;
  std::vector<int> machine_;   // ranks of this one
  std::vector<int> heads_;     // by rank, the first of its machine
  std::vector<State> states_;  // by rank
  int next_ = 0;               // whom to listen to first
  std::list<Sending> sending_;
  std::map<std::uint64_t, File> files_;
  std::map<std::uint64_t, Common> commons_;
  std::uint64_t lent_ = 0;
};

}  // namespace vdvr::cli
