// What a user asks about devices beside which there are: what their images can, what is wrong with one, and
// whether one computes as certificates assume.
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"

namespace vdvr {

/// A device or platform of the list, and why it cannot be used: the call that failed while it was described.
/// Empty where nothing did.
struct ListedDevice {
  DeviceInfo info;
  std::string trouble;
};
/// All, with the formats of their images, for which a context of each is opened. Numbers are those of
/// Device::list(), which leaves out whoever is in trouble.
VDVR_API std::vector<ListedDevice> describe_devices();

/// One thing that a device was asked to compute, and what came of it (docs/robustness.md).
struct DeviceCheck {
  std::string name;   ///< "contraction", "division", ...
  std::string found;  ///< what was wrong and by how much, "; " between; empty where it passed
};
/// What a device was asked when it was opened. Devices that pass are remembered, by driver and version.
struct DeviceTest {
  std::vector<DeviceCheck> checks;
  bool remembered = false;
  double seconds = 0;
  [[nodiscard]] VDVR_API bool passed() const;
  /// "contraction (a b + c: 48 of 64 wrong, as 1.1e-08 for 0, ...)", of each check what it found first; empty
  /// where all passed.
  [[nodiscard]] VDVR_API std::string failures() const;
  /// "contraction, two-sum, ..."
  [[nodiscard]] VDVR_API std::string names() const;
};
VDVR_API const DeviceTest& test_of(Device& device);

/// `tell` hears, in one line, of each device that is passed over for another, with its name and the reason,
/// and of one that is opened although it failed its test. Of the process; by whatever thread opens a device.
VDVR_API void tell_of_devices(std::function<void(const std::string&)> tell);

/// What to say of an exception that is none of vdvr/error.hpp's: of a call of OpenCL that failed where nobody
/// was ready for it, which call, its code and the device opened last; else what() itself.
VDVR_API std::string words_for(const std::exception& e);

/// Whether this process opens devices that fail their test, from now on: to draw. Nothing is certified with
/// one. Default: they are refused.
VDVR_API void open_untrusted_devices(bool open);

/// Throws DeviceError, which names what failed, where the device did not pass its test. `what`: "certifying a
/// volume". Whatever certifies calls it.
VDVR_API void require_trusted(Device& device, const std::string& what);

}  // namespace vdvr
