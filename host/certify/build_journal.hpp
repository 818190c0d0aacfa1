// What a build writes into its journal: what it depends on, and the parts of its records. Called by build.cpp
// and classify_bricks.cpp.
#pragma once

#include "host/gold/gold_batch.hpp"
#include "host/system/bytes.hpp"
#include "vdvr/build.hpp"

namespace vdvr {

/// `tolerance`: what the first attempt leaves for |V - gold| + T + P.
JournalHead journal_head(Device& device, const ProjectionSet& scan, const Plan& plan,
                         const BuildOptions& options, const GoldStream& stream, double tolerance);

void put(ByteWriter& out, const BrickMeasure& measure);
BrickMeasure get_measure(ByteReader& in);

}  // namespace vdvr
