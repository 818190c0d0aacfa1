// Where in a brick the stored field is farthest from gold, slack included: on the host, through the shared
// sampler.
#pragma once

#include <optional>

#include "host/certify/gold/gold_batch.hpp"

namespace vdvr {

/// World position of the node with the largest |V - gold| + T + P of a brick of a batch of gold at `rate`;
/// none where that tests no node of it.
std::optional<Vec3> worst_node(GoldStream::Batch& batch, const MixedVolume& volume, std::int64_t brick,
                               int rate);

}  // namespace vdvr
