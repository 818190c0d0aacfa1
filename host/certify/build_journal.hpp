// What a build writes into its journal: what it depends on, and the parts of its records. Called by build.cpp
// and classify_bricks.cpp.
#pragma once

#include <string>

#include "host/gold/gold_batch.hpp"
#include "host/system/bytes.hpp"
#include "vdvr/build.hpp"

namespace vdvr {

/// The plan is made again by a resumed process: this stands for it, before its base samples are given away.
std::string plan_digest(const ProjectionSet& scan, const Plan& plan);
/// `tolerance`: what the first attempt leaves for |V - gold| + T + P.
JournalHead journal_head(Device& device, const ProjectionSet& scan, const Plan& plan,
                         const std::string& digest, const BuildOptions& options, const GoldStream& stream,
                         double tolerance);

void put(ByteWriter& out, const BrickMeasure& measure);
BrickMeasure get_measure(ByteReader& in);

}  // namespace vdvr
