// Several devices, and several processes, for one build (docs/scaling.md). The volume and its certificate are
// those of one device, to the bit.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/common_memory.hpp"

namespace vdvr {

/// Carries messages between the process that leads a build, number 0, and others, which join_crew(). A
/// program has one; the library knows no MPI. Called by one thread.
class VDVR_API Messenger {
 public:
  Messenger() = default;
  Messenger(const Messenger&) = delete;
  Messenger& operator=(const Messenger&) = delete;
  virtual ~Messenger() = default;

  /// The others of the leader: 1 .. others().
  [[nodiscard]] virtual int others() const = 0;
  /// Of this process among those of its machine, and how many these are.
  [[nodiscard]] virtual int place() const = 0;
  [[nodiscard]] virtual int neighbours() const = 0;
  /// Takes the message and does not wait until it has arrived. Messages to one process keep their order. What
  /// is sent to a process that is gone is lost.
  virtual void send(int to, std::vector<std::byte> message) = 0;
  /// The next message and who sent it; none within that time.
  virtual std::optional<std::pair<int, std::vector<std::byte>>> receive(std::chrono::milliseconds wait) = 0;
  /// Of the leader: all the others will be able to read these bytes, once for each machine, by the number
  /// returned.
  virtual std::uint64_t lend(std::span<const std::byte> bytes) = 0;
  /// Of the others: those bytes, and what keeps them. Waits for them.
  virtual std::pair<std::span<const std::byte>, std::shared_ptr<const void>> lent(std::uint64_t number) = 0;
  /// Memory of at least so many bytes, zeros at first, that all of this machine who ask by that number read
  /// and write; empty where there is none to be had, or the first of the machine has not asked for it in
  /// time.
  virtual CommonMemory common(std::uint64_t number, std::uint64_t bytes) = 0;
  /// Whether it is known to have ended.
  [[nodiscard]] virtual bool is_gone(int process) const = 0;
  /// Nothing more is sent to it and nothing awaited from it.
  virtual void give_up(int process) = 0;
};

/// Beside the device that build() is given.
struct CrewOptions {
  std::vector<Device*> devices;        ///< of this process; not owned
  Messenger* messenger = nullptr;      ///< to other processes; not owned
  std::string device_of_others;        ///< what their Device is opened with; of "0,1" each takes one, in turn
  std::uint64_t memory_of_others = 0;  ///< for all of a machine; 0: half of what is free there
  std::string scratch_of_others;
  /// Devices may differ: the certificate names all, charges the worst, and which device computes what decides
  /// bits.
  bool mixed_devices = false;
  /// After so long without a sign of life a process is given up, and its blocks are given to others.
  std::chrono::seconds give_up{300};
  std::function<void(const std::string&)> say;  ///< for the user: who was given up, and why

  [[nodiscard]] bool alone() const { return devices.empty() && (!messenger || messenger->others() == 0); }
};

/// Has other processes open their devices, and build each kernel program that this device builds from now on,
/// so that they need not when a build begins. For the time before it, while `leader` plans; called by the
/// thread that does. What fails there is said when the build begins. Without a messenger nothing is done.
VDVR_API void wake(Device& leader, const CrewOptions& options);

/// Computes blocks for the leader until it says that it is done. Opens the device that the leader names.
/// Throws what opening it throws, after the leader was told.
VDVR_API void join_crew(Messenger& messenger);
/// Tells all others that nothing more will come.
VDVR_API void dismiss(Messenger& messenger);

}  // namespace vdvr
