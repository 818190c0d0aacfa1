// What the steps of a build share, and the certificate of what they made.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host/certify/classify_bricks.hpp"
#include "host/certify/crew/journalled_gold.hpp"
#include "vdvr/expert/build.hpp"

namespace vdvr {

class Stopwatch {
 public:
  explicit Stopwatch(std::map<std::string, double>& seconds) : seconds_(seconds) {}
  void lap(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds_[stage] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  std::map<std::string, double>& seconds_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// What every step of a build reads. All but the scan, and what is thrown, in `units`.
struct Inputs {
  opencl::State& state;
  const Units& units;
  const Plan& plan;
  const std::vector<std::uint8_t>& selected;  // by brick: in the region of interest
  JournalledRates& gold;
  GoldRates& rates;
  Crew* crew;                  // none: the device alone
  double arithmetic = 0;       // fp32 error bound of any gold sample
  const MemoryBudget& budget;  // for what is made of the bricks
  const Progress& progress;
  Stopwatch& watch;
};

/// A closed and packed volume that was measured, node by node, to be within a tolerance.
struct Measured {
  MixedVolume volume;
  std::vector<BrickMeasure> bricks;
  ClassifyBricks::Bounds slack;
  std::int64_t repaired = 0;  // bricks that closing raised
};

Certificate fill_certificate(const Inputs& in, Device& device, const ProjectionSet& scan,
                             const FilteredScan& filtered, const BuildOptions& options,
                             const Measured& measured, const SamplerTerms& sampler, double epsilon_abs);

}  // namespace vdvr
