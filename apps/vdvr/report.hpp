// report.html: one page that says everything about a run and needs nothing beside it. Called by run.cpp.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "apps/vdvr/report_measured.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/verify.hpp"

namespace vdvr::cli {

struct ReportPicture {
  std::string name, caption;
  std::string outside;  ///< what no certificate covers of it; may be empty
  std::string png;      ///< the file's bytes
};

/// What `run` knows.
struct RunReport {
  const ProjectionSet& scan;  ///< its samples are not read
  const MixedVolume& volume;
  const Certificate& certificate;
  const VerifyResult& verified;
  const ErrorSlice& error;
  std::string sampler{}, sampler_reason{};
  DeviceInfo device{};
  std::vector<std::pair<std::string, double>> seconds{};  ///< by stage, in order
  std::map<std::string, double> build_seconds{};
  std::uint64_t file_bytes = 0;
  std::vector<ReportPicture> pictures{};
  std::optional<MeasuredByRun> measured{};
  std::vector<std::string> run_words{}, verify_words{};  ///< the commands to make it again, word by word
};

/// The page: HTML5 in UTF-8 with styles, charts and pictures inside; no script, nothing fetched. Every text
/// of the scan is escaped. <data value> holds numbers in full; its data-member names that of
/// certificate.json.
std::string report_page(const RunReport& run);

}  // namespace vdvr::cli
