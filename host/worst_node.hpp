// Where in a brick the stored field is farthest from gold, slack included: on the host, through the shared
// sampler. Called by build.cpp.
#pragma once

#include "host/gold_stream.hpp"

namespace vdvr {

/// World position of the node with the largest |V - gold| + T + P of a brick of the batch.
Vec3 worst_node(const GoldStream::Batch& batch, const MixedVolume& volume, std::int64_t brick);

}  // namespace vdvr
