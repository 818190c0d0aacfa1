// What `verify` and `run` say about a certificate measured again.
#pragma once

#include "apps/vdvr/output.hpp"
#include "vdvr/expert/verify.hpp"

namespace vdvr::cli {

Json verification_json(const VerifyResult& measured, const Certificate& certified);
void print_verification(const VerifyResult& measured, const Certificate& certified);

}  // namespace vdvr::cli
