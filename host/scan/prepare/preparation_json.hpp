// A Preparation as it stands in the certificate's `field` (docs/file-format.md).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "vdvr/expert/preparation_steps.hpp"

namespace vdvr {

/// Only the steps that are done.
nlohmann::json json_of(const Preparation& preparation);
/// Throws InputError for an unknown step or member, a missing one, or a value out of its range.
Preparation preparation_of(const nlohmann::json& json);

}  // namespace vdvr
