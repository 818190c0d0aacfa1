// An InputStatement as it stands in the certificate's `options` (docs/file-format.md).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "vdvr/expert/input_statement.hpp"

namespace vdvr {

/// Only what is stated.
nlohmann::json json_of(const InputStatement& statement);
/// Throws InputError for an unknown member, or a value that is none.
InputStatement input_statement_of(const nlohmann::json& json);

}  // namespace vdvr
