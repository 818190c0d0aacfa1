// Exceptions of the library. Each carries the exit code a command line should end with; stages add one line
// of context on the way up with `add_context`. Library code never prints and never exits.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "vdvr/export.hpp"

namespace vdvr {

class VDVR_API Error : public std::exception {
 public:
  Error(int exit_code, std::string message) : exit_code_(exit_code), message_(std::move(message)) {}
  [[nodiscard]] const char* what() const noexcept override { return message_.c_str(); }
  [[nodiscard]] int exit_code() const noexcept { return exit_code_; }
  /// Puts "context: " before the message; used by the stage that knows more than the thrower.
  void add_context(const std::string& context) { message_ = context + ": " + message_; }

 private:
  int exit_code_;
  std::string message_;
};

/// Bad usage: an option or a value the caller gave.
struct VDVR_API InputError : Error {
  explicit InputError(std::string message) : Error(2, std::move(message)) {}
};
/// A file that is missing, truncated, of the wrong type, or fails a checksum. Message: path, dataset, value,
/// remedy.
struct VDVR_API FileError : Error {
  explicit FileError(std::string message) : Error(2, std::move(message)) {}
};
/// A readable file whose certificate, hash or input does not match.
struct VDVR_API MismatchError : Error {
  explicit MismatchError(std::string message) : Error(1, std::move(message)) {}
};
/// A tolerance that cannot be reached: names the binding term and what would do.
struct VDVR_API ToleranceError : Error {
  explicit ToleranceError(std::string message) : Error(1, std::move(message)) {}
};
/// A failing OpenCL or clFFT call: call, code by name, kernel, ranges, device.
struct VDVR_API DeviceError : Error {
  explicit DeviceError(std::string message) : Error(3, std::move(message)) {}
};
/// A kernel program that does not build: program, defines, device, log.
struct VDVR_API BuildError : Error {
  explicit BuildError(std::string message) : Error(3, std::move(message)) {}
};
/// Memory, disk or another resource; names the remedy.
struct VDVR_API ResourceError : Error {
  explicit ResourceError(std::string message) : Error(3, std::move(message)) {}
};
/// The user asked to stop (SIGINT: 130, SIGTERM: 143).
struct VDVR_API Interrupted : Error {
  explicit Interrupted(int exit_code, std::string message = "interrupted")
      : Error(exit_code, std::move(message)) {}
};

}  // namespace vdvr
