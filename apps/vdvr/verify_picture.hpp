// verify --picture: what a certificate of a picture says, once more.
#pragma once

#include "apps/vdvr/options.hpp"

namespace vdvr::cli {

/// Throws MismatchError where a hash, an interval or F does not agree.
int verify_picture_command(const Arguments& args, const CommonOptions& common);

}  // namespace vdvr::cli
