// What is promised about a volume, and by which argument. An error is a value with its method, never a loose
// float.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/rates.hpp"

namespace vdvr {

struct ErrorTerm {
  double value = 0;    ///< largest, in density units
  std::string method;  ///< "measured", "curvature", "amplitude", "rounding", "device probe", ...
};

struct SamplerTerms {
  ErrorTerm buffer;
  /// Absent where the device has no such sampler. Of a volume: how far the largest bound of a brick lies
  /// above measured_total and arithmetic.
  std::optional<ErrorTerm> image3d;
  /// [bz][by][bx] what the texture unit may err by in each brick. Not in the JSON: another device has its own
  /// (certificate_on() of safe_sampler.hpp).
  std::vector<float> image3d_by_brick;
};

struct ErrorBudget {
  ErrorTerm grid;        ///< |V - gold| at gold nodes
  ErrorTerm gold;        ///< T: gold's own trilinear interpolation
  ErrorTerm projection;  ///< P: interpolation of the projections in u
  ErrorTerm arithmetic;  ///< rounding in fp32
  SamplerTerms sampler;
};

/// One bound as computed by the plan, by stage and rate; shown side by side.
struct Bound {
  std::string stage;   ///< "projection" or "gold"
  std::string method;  ///< "amplitude", "paper Eq. 7", "curvature signed, node-wise", ...
  int rate = 1;
  double value = 0;
  bool rigorous = false;
};

/// An upright cylinder about the rotation axis, x = y = 0, world: points that certificates speak of.
struct CoveredCylinder {
  double radius = 0;
  std::pair<double, double> z{0, 0};
};

/// What the scan's own noise does to F: an estimate (docs/noise.md), beside what is proved.
struct NoiseRecord {
  std::string source;  ///< LineIntegralNoise::source
  double photons = 0;  ///< of a pixel in the open beam; 0 where the noise is not of counts
  double least = 0, median = 0, largest = 0;  ///< the standard deviation sigma of F at covered samples
  /// Promised: at covered points of each brick |V - F| is at most that many sigmas of the brick.
  std::optional<double> tolerance_sigmas;
  /// The root mean square of (V - F) / sigma at `rms_points` points between samples: an estimate. Nothing in
  /// files of earlier versions.
  std::optional<double> rms_in_sigma;
  std::int64_t rms_points = 0;
  /// SplitOfViews::ratio() and `resolved`: what halves of the views differ by over what sigma says, a check
  /// without a model. Nothing where views are too few, and in files of earlier versions.
  std::optional<double> split_ratio;
  bool split_resolved = false;
  /// worst_in_sigma() of image3d on the device that built the file.
  std::optional<double> worst_image3d;
  std::string sha256;  ///< of Certificate::brick_sigma
};

struct Certificate {
  double epsilon = 0;          ///< fraction of reference_range
  double epsilon_abs = 0;      ///< density units
  double reference_range = 0;  ///< max - min of F over covered 1x samples
  /// The smallest and the largest of these, world units. Nothing where none is covered, and in files of
  /// earlier versions.
  std::optional<std::array<Vec3, 2>> range_at;
  /// Stored in a file that holds a seal over it (docs/file-format.md).
  bool sealed = false;
  /// No certificate, but the record of a volume that nothing certifies (Comparison): what was measured and
  /// with what it was built. It promises nothing, and a file keeps it under another name.
  bool comparison = false;
  bool holds_buffer = false;
  std::optional<bool> holds_image3d;
  double total_buffer = 0;
  std::optional<double> total_image3d;
  ErrorBudget budget;
  double measured_max = 0;    ///< max |V - gold| over tested gold nodes; of a brick at most its total
  double measured_total = 0;  ///< max over them of |V - gold| + T + P
  /// [bz][by][bx] the same brick by brick, whose largest is measured_total; negative where nothing was
  /// tested. Empty for files of earlier versions. Not in the JSON: a dataset of the file.
  std::vector<float> brick_totals;
  std::optional<NoiseRecord> noise;  ///< nothing where no noise was found, and in files of earlier versions
  /// [bz][by][bx] with `noise`: sigma of F in each brick, density units. Not in the JSON: a dataset.
  std::vector<float> brick_sigma;
  Vec3 worst_at{0, 0, 0};
  Rates rates;
  std::vector<Bound> bounds;
  FieldOptions field;
  std::int64_t padding = 0;  ///< length of the ramp filter's FFT
  std::optional<std::pair<double, double>> window;
  std::optional<std::array<double, 6>> roi;
  /// The largest such cylinder; nothing in files of earlier versions.
  std::optional<CoveredCylinder> covered;
  std::int64_t not_covered_count = 0;
  double not_covered_fraction = 0;
  std::string not_covered_rule;
  std::string input_name, input_sha256;
  std::vector<std::int64_t> input_shape;  ///< views, rows, columns
  std::int64_t input_angles = 0;
  std::string content_sha256;
  std::string device, driver, version;
  std::string options_json = "{}";  ///< the options the volume was built with, as a JSON object
  std::vector<std::string> notes;   ///< what the certificate does not cover, and what was noticed
};

/// What |V - F| can be at covered points of each brick, sampled by `buffer` or image3d: its total, rounding
/// and the sampler; infinite where nothing was tested. Throws InputError where the certificate has no totals
/// by brick, or says nothing of image3d on this device: what a file says is another's (certificate_on()).
VDVR_API std::vector<float> brick_bounds(const Certificate& certificate, bool image3d);

/// The largest of brick_bounds() over sigma; 0 where nothing was tested or no sigma is known. Of image3d in a
/// file what was found when it was built.
VDVR_API double worst_in_sigma(const Certificate& certificate, bool image3d);
/// Whether a volume of this total, drawn by that sampler, is within the tolerance: epsilon_abs, and the
/// promise in sigma where there is one.
VDVR_API bool within_tolerance(const Certificate& certificate, double total, bool image3d);
/// Puts what samplers take into the certificate of a volume: the budget, and both totals. That of image3d is
/// the largest over the bricks of their totals and what the unit may err by there, with arithmetic.
VDVR_API void charge_samplers(Certificate& certificate, SamplerTerms samplers);
/// SHA-256 of sigma by brick, as NoiseRecord has it.
VDVR_API std::string sigma_sha256(const std::vector<float>& brick_sigma);

/// One line where the certificate's own numbers do not follow from each other; empty where they do.
VDVR_API std::string contradiction(const Certificate& certificate);

/// The JSON of docs/file-format.md; finite numbers only. A record of a comparison has neither 'holds' nor
/// 'total'.
VDVR_API std::string to_json(const Certificate& certificate);
/// Throws FileError naming the missing or ill-typed member.
VDVR_API Certificate certificate_from_json(const std::string& text);

}  // namespace vdvr
