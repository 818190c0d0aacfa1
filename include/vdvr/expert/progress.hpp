// Progress of long work, and the user's wish to stop. The library calls `report`; it never prints itself.
#pragma once

#include <functional>
#include <string>

namespace vdvr {

/// `stage` names the work ("gold", "verify", ...), `fraction` is in [0, 1]. The callee may throw Interrupted.
using Progress = std::function<void(const std::string& stage, double fraction)>;

inline void report(const Progress& progress, const std::string& stage, double fraction) {
  if (progress) progress(stage, fraction);
}

}  // namespace vdvr
