// The way from the words after `plan`, `build`, `run` and `bench build` to a plan and to a certified volume.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "apps/common/common_options.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/options.hpp"
#include "vdvr/certify_scan.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/understood.hpp"

namespace vdvr::cli {

/// Scan, tolerance, field, grid and rate options.
void add_plan_options(Arguments& args);

/// Everything that can be refused before a scan is read.
struct Wanted {
  AskedTolerance asked;
  bool chosen_by_noise = false;  ///< no tolerance was given: 1 sigma where the noise is known well, else 3 %
  bool noted_noise = true;       ///< sigma of F is looked for, whatever the tolerance
  CertifyOptions options;
  Compression compression = Compression::deflate;  ///< of the file; `build` and `run` fill it in
};
/// `may_choose_tolerance`: none need be given.
Wanted wanted_of(const Arguments& args, bool may_choose_tolerance = false);

/// All that `build` and `run` take besides their input and output.
void add_certify_options(Arguments& args);
/// What they are asked for: a plan without what is foreseen, and the file's compression.
Wanted wanted_to_certify(const Arguments& args, bool may_choose_tolerance = false);

struct Planned {
  ProjectionSet scan;
  Understood understood;  ///< of its files
  NoiseFound noise;       ///< of the scan
  std::string chosen;     ///< one line, where the tolerance was chosen: which, and why
  PlannedScan made;
};
/// How refinement went: what it was asked, each round, whether the tolerance is met. Null without pictures.
Json pictures_json(const Planned& planned);
void print_pictures(const Planned& planned);
/// Reads IN and plans. `seen` is called between the two, when the tolerance is known.
Planned read_and_plan(Device& device, const Arguments& args, const Wanted& wanted, const Progress& progress,
                      const std::function<void(const Planned&)>& seen = {});
/// By certify_planned(). Takes the plan.
BuildResult build_planned(Device& device, Planned& planned, const Wanted& wanted, const Progress& progress);

/// The journal of an output file: beside it, with this name.
std::filesystem::path journal_path(const std::filesystem::path& output);
/// Whether --resume was given and earlier processes left something to continue or to join: its own outputs
/// are then no reason to refuse.
bool continues(const Arguments& args, const std::filesystem::path& output);
/// The journals of a build: its own, and those of shares that it joins.
struct Journals {
  std::unique_ptr<Journal> own;
  std::vector<std::unique_ptr<Journal>> parts;

  void name_in(BuildOptions& build) const;
  /// The result is in place.
  void remove();
  [[nodiscard]] std::int64_t replayed() const;
};
/// Opens them for `build` and `run`, clears away what killed writers of `outputs` left, and says on stderr
/// when there is nothing to resume or a journal is about to be replaced.
Journals open_journals(const Arguments& args, const CommonOptions& common,
                       const std::filesystem::path& output,
                       const std::vector<std::filesystem::path>& outputs);
/// The same of a share, which joins nothing.
std::unique_ptr<Journal> open_journal(const Arguments& args, const CommonOptions& common,
                                      const std::filesystem::path& path);
/// Calls `work`; an interruption in it says that --resume continues, once there is anything to continue.
int resumable(const Journal& journal, const std::function<int()>& work);

/// 1, after a line on stderr, where pictures are not within what was asked.
int pictures_exit_code(const std::string& who, const Planned& planned);
/// 0 when the certificate holds for every sampler of the device it was built on, else 1 after a line on
/// stderr.
int certificate_exit_code(const std::string& who, const Certificate& certificate);

}  // namespace vdvr::cli
