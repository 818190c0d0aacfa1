// What a build depends on, as its journal says it.
#pragma once

#include <string>
#include <vector>

#include "host/certify/crew/crew.hpp"
#include "vdvr/expert/build.hpp"

namespace vdvr {

/// "auto", "f32", "u16", "u8".
const char* text_of(StorageChoice storage);

/// The plan is made again by a resumed process: this stands for it, before its base samples are given away.
std::string plan_digest(const ProjectionSet& scan, const Plan& plan);
/// `tolerance`: what the first attempt leaves for |V - gold| + T + P.
JournalHead journal_head(const std::vector<Crew::Kind>& devices, const ProjectionSet& scan, const Plan& plan,
                         const std::string& digest, const BuildOptions& options, const GoldStream& stream,
                         double tolerance);

}  // namespace vdvr
