// Exceptions of the library. Messages name fields of options as `max_memory`; a program may put its own words
// for them. Stages add one line of context on the way up with `add_context`. Library code never prints and
// never exits.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "vdvr/api.hpp"

namespace vdvr {

enum class ErrorKind { input, file, mismatch, tolerance, device, build, resource, interrupted };

class VDVR_API Error : public std::exception {
 public:
  Error(ErrorKind kind, std::string message) : kind_(kind), message_(std::move(message)) {}
  [[nodiscard]] const char* what() const noexcept override { return message_.c_str(); }
  [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }
  /// Puts "context: " before the message; used by the stage that knows more than the thrower.
  void add_context(const std::string& context) { message_ = context + ": " + message_; }

 private:
  ErrorKind kind_;
  std::string message_;
};

/// Bad usage: a value that the caller gave.
struct VDVR_API InputError : Error {
  explicit InputError(std::string message) : Error(ErrorKind::input, std::move(message)) {}
};
/// A file that is missing, truncated, of the wrong type, or fails a checksum. Message: path, dataset, value,
/// remedy.
struct VDVR_API FileError : Error {
  explicit FileError(std::string message) : Error(ErrorKind::file, std::move(message)) {}
};
/// A readable file whose certificate, hash or input does not match.
struct VDVR_API MismatchError : Error {
  explicit MismatchError(std::string message) : Error(ErrorKind::mismatch, std::move(message)) {}
};
/// A tolerance that cannot be reached: names the binding term and what would do.
struct VDVR_API ToleranceError : Error {
  explicit ToleranceError(std::string message) : Error(ErrorKind::tolerance, std::move(message)) {}
};
/// A failing OpenCL or clFFT call: call, code by name, kernel, ranges, device.
struct VDVR_API DeviceError : Error {
  explicit DeviceError(std::string message) : Error(ErrorKind::device, std::move(message)) {}
};
/// A kernel program that does not build: program, defines, device, log.
struct VDVR_API BuildError : Error {
  explicit BuildError(std::string message) : Error(ErrorKind::build, std::move(message)) {}
};
/// Memory, disk or another resource; names the remedy.
struct VDVR_API ResourceError : Error {
  explicit ResourceError(std::string message) : Error(ErrorKind::resource, std::move(message)) {}
};
/// Somebody asked to stop (stop.hpp).
struct VDVR_API Interrupted : Error {
  explicit Interrupted(int reason, std::string message = "interrupted")
      : Error(ErrorKind::interrupted, std::move(message)), reason_(reason) {}
  /// The reason that request_stop was told.
  [[nodiscard]] int reason() const noexcept { return reason_; }

 private:
  int reason_;
};

}  // namespace vdvr
