#include "vdvr/expert/measure.hpp"

#include "host/measure/mean_weights.hpp"
#include "host/measure/measure_components.hpp"
#include "host/measure/measure_distribution.hpp"
#include "host/measure/measure_line.hpp"
#include "host/measure/measure_mean.hpp"
#include "host/measure/measure_volume.hpp"
#include "vdvr/verify_file.hpp"

namespace vdvr {

Measurement::Measurement(const MixedVolume& volume, const Certificate& certificate,
                         const MeasureRegion& region)
    : field_(std::make_unique<const measured::Field>(volume, certificate, region)) {}
Measurement::~Measurement() = default;
Measurement::Measurement(Measurement&&) noexcept = default;
Measurement& Measurement::operator=(Measurement&&) noexcept = default;

VolumeMeasure Measurement::volume(const ValueRange& range, const MeasureOptions& options,
                                  const Progress& progress) const {
  return measured::measure_volume(*field_, range, options, progress);
}

MeanMeasure Measurement::mean(const Progress& progress) const {
  return measured::measure_mean(*field_, progress);
}

MeanOfScan Measurement::mean_of_scan(const ProjectionSet& scan, const MeanNoise& noise,
                                     std::uint64_t max_memory_bytes, const Progress& progress) const {
  check_input(scan, field_->certificate());
  return vdvr::mean_of_scan(scan, field_->certificate().field, field_->region(), noise, max_memory_bytes,
                            progress);
}

ExtremesMeasure Measurement::extremes(const Progress& progress) const {
  return measured::measure_extremes(*field_, progress);
}

Distribution Measurement::distribution(const std::vector<double>& edges, const Progress& progress) const {
  return measured::measure_distribution(*field_, edges, progress);
}

ComponentTable Measurement::components(const ValueRange& range, const ComponentsOptions& options,
                                       const Progress& progress) const {
  return measured::measure_components(*field_, range, options, progress);
}

LineMeasure Measurement::along(const Vec3& p, const Vec3& q, const LineOptions& options) const {
  return measured::measure_line(*field_, p, q, options);
}

}  // namespace vdvr
