// A certificate with every member set, with values that need all 17 digits.
#pragma once

#include "vdvr/expert/certificate.hpp"

namespace vdvr::support {

inline Certificate full_certificate() {
  Certificate c;
  c.epsilon = 0.03;
  c.epsilon_abs = 0.03 * 1.126;
  c.reference_range = 1.126;
  c.range_at = {Vec3{0.1, -2.0 / 3, 5}, Vec3{-7, 1e-9, 3.3}};
  c.holds_buffer = true;
  c.holds_image3d = true;
  c.total_buffer = 1.0 / 3;
  c.total_image3d = 0.1 + 0.2;
  c.budget.grid = {0x1.fffffffffffffp-7, "measured"};
  c.budget.gold = {5e-324, "curvature signed, node-wise"};
  c.budget.projection = {1e-300, "curvature"};
  c.budget.arithmetic = {1.7976931348623157e308, "rounding"};
  c.budget.sampler.buffer = {0.0, "in arithmetic"};
  c.budget.sampler.image3d = ErrorTerm{2.0 / 3, "device probe"};
  c.measured_max = 0.7 / 3;
  c.measured_total = 0.3;
  c.worst_at = {1.0 / 7, -2.0 / 7, 3e22};
  c.rates.upsampling = 16;
  c.rates.gold = 8;
  c.bounds = {{"projection", "amplitude", 8, 0.1, false},
              {"projection", "curvature", 16, 1.0 / 11, true},
              {"gold", "paper Eq. 7", 8, 0.25, false}};
  c.field = {RampWindow::hann, 0.9, 85.85, {}};
  c.padding = 256;
  c.window = {0.1, 0.4};
  c.roi = std::array<double, 6>{-1, -2, -3, 1.5, 2.5, 3.5};
  c.not_covered_count = 12;
  c.not_covered_fraction = 12.0 / 274625;
  c.not_covered_rule = "outside the detector in some view";
  c.input_name = "tooth \"x\" \xc3\xa9.h5";
  c.input_sha256 = std::string(64, 'a');
  c.input_shape = {74, 65, 65};
  c.input_angles = 74;
  c.device = "some device";
  c.driver = "1.2";
  c.version = "0.1.0";
  c.options_json = R"({"granularity":4,"closing":"coarse","nested":{"b":1,"a":0.1}})";
  c.notes = {"interpolation only", "views close to each other: 2"};
  return c;
}

}  // namespace vdvr::support
