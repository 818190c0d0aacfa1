// What a certificate charges for the samplers of a field on the device of a test.
#pragma once

#include <boost/test/unit_test.hpp>

#include "host/volume/sampler/sampler_terms.hpp"
#include "tests/support/device.hpp"
#include "vdvr/expert/probe_sampler.hpp"

namespace vdvr::support {

/// At least how far apart the two samplers' fields lie: what both may err. Throws where there is no image3d.
inline double charged_between_samplers(const MixedVolume& v) {
  const DeviceInfo& info = device().info();
  const SamplerTerms terms = sampler_terms(field_slopes(v), v.grid, probe_sampler(device()),
                                           atlas_length(info, v), 0, v.rate, sampler_underflow(info));
  return terms.buffer.value + terms.image3d.value().value;
}

/// Whether the filter weighs as fp32 does; texture units weigh by 8 bits.
inline bool filters_exactly() { return probe_filters(device()).weighs_in_fp32(); }

/// A precondition of tests that take a builder without a coarse texture unit for granted; others are skipped
/// by name.
inline boost::test_tools::assertion_result on_fp32_weights(boost::unit_test::test_unit_id) {
  return filters_exactly();
}

}  // namespace vdvr::support
