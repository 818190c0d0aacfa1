#include "tests/support/places.hpp"

namespace vdvr::support {

const char* const source_dir = VDVR_SOURCE_DIR;
const char* const vdvr_binary = VDVR_BINARY;

}  // namespace vdvr::support
