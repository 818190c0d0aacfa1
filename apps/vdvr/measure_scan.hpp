// The projections of a volume that is measured, as `measure --mean --projections` has them. Called by
// measure.cpp.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/vdvr/options.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/line_noise.hpp"
#include "vdvr/expert/mean_of_scan.hpp"
#include "vdvr/expert/measure.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::cli {

struct ScanOfFile {
  ProjectionSet projections;
  std::optional<LineIntegralNoise> noise;
  std::int64_t flats = 0;
  std::string source;  ///< of the noise, or why there is none
};
/// Under the certificate's field options. Throws MismatchError where the certificate is of another scan.
ScanOfFile scan_of_file(const Arguments& args, const Certificate& certificate, const Progress& progress);

std::vector<std::string> mean_of_scan_lines(const MeanOfScan& own, const MeanMeasure& of_volume,
                                            const std::string& source);

}  // namespace vdvr::cli
