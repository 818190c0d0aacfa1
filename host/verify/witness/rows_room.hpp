// Where verify's own rows lie: in a scratch file by the rule for scans, whatever lay there of the scan that
// was measured, since rows that are made longer can pass the limit that these did not.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "vdvr/expert/scratch.hpp"

namespace vdvr {

/// For so many views, rows and columns: a scratch file, or nullptr for memory.
using RowsRoom =
    std::function<std::shared_ptr<Scratch>(std::int64_t views, std::int64_t rows, std::int64_t columns)>;

}  // namespace vdvr
