// Flats taken at several places among the projections, and a beam whose current is known
// (docs/preparation.md, "Flats in time").
//
// Flats between which no projection was taken are a run. With c the currents over the flats' mean current (1
// where none are known), a run's gain is the mean of (flat - dark) / c over its flats, at the mean of their
// places in the order of frames. A projection's gain lies between those of the runs around it, linearly in
// the order of frames, times its own c; before the first and after the last run it is theirs.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host/scan/raw/raw_scan.hpp"
#include "vdvr/expert/preparation_steps.hpp"

namespace vdvr {

/// The flats of each run, in the order of frames; all of them as one run where no order is known.
std::vector<std::vector<std::int64_t>> runs_of_flats(const io::RawScan& raw);

class FlatsInTime {
 public:
  /// Looks at places and currents, and reads nothing. Throws InputError, which names what is wrong, where
  /// `wanted` asks for what the scan does not tell, or where a current is no positive number.
  FlatsInTime(const io::RawScan& raw, const Preparation& wanted);

  /// The mean of all flats is the gain of all projections.
  [[nodiscard]] bool none() const { return runs_.empty(); }
  /// Writes down what is done; the words that say it, one line each.
  std::vector<std::string> record(Preparation& recorded) const;
  /// Bytes of the gains that so many views in a row need at most.
  [[nodiscard]] std::uint64_t bytes(std::int64_t views) const;

  /// Reads the runs around the views first .. first + n - 1, and lets go of the others.
  void go_to(std::int64_t first, std::int64_t n, const std::vector<double>& dark);
  /// Of a view of these: [row][column]; NaN where it is not positive and finite.
  [[nodiscard]] std::vector<double> gain(std::int64_t view) const;

 private:
  struct Run {
    std::vector<std::int64_t> flats;
    double at = 0;
  };
  /// The run before a view or at it, the next one (the same at the ends), and how far the view is from it.
  struct Between {
    std::size_t before = 0, after = 0;
    double share = 0;
  };
  [[nodiscard]] Between between(std::int64_t view) const;
  [[nodiscard]] std::vector<double> gain_of(const Run& run, const std::vector<double>& dark) const;

  const io::RawScan& raw_;
  std::vector<Run> runs_;
  bool in_time_ = false, by_current_ = false;
  double mean_current_ = 1;  ///< of the flats
  std::map<std::size_t, std::vector<double>> gains_;
};

}  // namespace vdvr
