#include "apps/vdvr/certify.hpp"

#include <fmt/format.h>

#include <utility>

#include "apps/vdvr/inputs.hpp"
#include "apps/common/progress.hpp"
#include "host/io/atomic_file.hpp"
#include "vdvr/error.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::cli {

void add_plan_options(Arguments& args) {
  add_scan(args);
  add_tolerance(args);
  add_field(args);
  add_grid(args);
  add_rates(args);
}

CertifyOptions certify_options(const Arguments& args) {
  return {field_options(args), grid_options(args),  rate_options(args),
          tolerance(args),     build_options(args), plan_settings(args)};
}

Planned read_and_plan(Device& device, const Arguments& args, const CertifyOptions& options,
                      const Progress& progress) {
  Planned planned;
  planned.scan = load_scan(args.path("IN"), args, options.field, progress);
  FieldOptions field = options.field;
  field.center = center_of(field, planned.scan.geometry);
  const Grid grid = make_grid(planned.scan.geometry, options.grid);
  planned.plan =
      make_plan(device, planned.scan, grid, field, options.rates, options.tolerance, options.plan, progress);
  return planned;
}

std::filesystem::path journal_path(const std::filesystem::path& output) {
  return output.string() + ".journal";
}

bool continues(const Arguments& args, const std::filesystem::path& output) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(journal_path(output), error);
  return args.has("resume") && !error && bytes > 0;
}

std::unique_ptr<Journal> open_journal(const Arguments& args, const CommonOptions& common,
                                      const std::filesystem::path& output,
                                      const std::vector<std::filesystem::path>& outputs) {
  const bool resume = args.has("resume");
  auto journal = std::make_unique<Journal>(journal_path(output), resume);
  for (const auto& file : outputs) io::remove_leftovers(file);
  if (!common.quiet && resume != journal->found())
    say(fmt::format(
        "{}: {} {}\n", args.who(), journal->path().string(),
        resume ? "does not exist: nothing to resume, starting afresh"
               : "is of an unfinished build, which --resume would have continued: it will be replaced"));
  return journal;
}

int resumable(const Journal& journal, const std::function<int()>& work) {
  const std::string stays =
      fmt::format("interrupted; {} stays: the same command with --resume continues", journal.path().string());
  // Called once files that hold nothing are gone.
  explain_interruption([path = journal.path(), stays] {
    std::error_code error;
    return std::filesystem::exists(path, error) ? stays : std::string("interrupted");
  });
  struct Forget {
    ~Forget() { explain_interruption({}); }
  } const forget;
  try {
    return work();
  } catch (const Interrupted& e) {
    if (journal.records() == 0) throw;
    throw Interrupted(e.exit_code(), stays);
  }
}

BuildResult build_certified(Device& device, const Planned& planned, const CertifyOptions& options,
                            const Progress& progress) {
  BuildResult result = [&] {
    try {
      return build(device, planned.scan, planned.plan, options.build, progress);
    } catch (const ToleranceError&) {
      if (options.build.journal) options.build.journal->remove();  // going on would end here again
      throw;
    }
  }();
  Certificate& c = result.certificate;
  // A tested node has a share of each kind, if only of rounding: none at all means that nothing was tested
  // (but in a scan of nothing but zeros, whose range is 0).
  if ((c.window || c.roi) && c.reference_range > 0 && c.measured_total == 0 && c.budget.gold.value == 0)
    throw InputError("--window or --roi leaves no covered gold node to test: nothing would be certified");
  if (!c.holds_buffer && !c.comparison)
    throw ToleranceError(fmt::format(
        "the volume misses its tolerance: total {:.6g} > epsilon {:.6g} at {:.6g}, {:.6g}, {:.6g}",
        c.total_buffer, c.epsilon_abs, c.worst_at[0], c.worst_at[1], c.worst_at[2]));
  BuildOptions taken = options.build;
  taken.granularity = result.volume.granularity;  // less than asked for on a grid thinner than a brick
  c.options_json = options_json(planned.plan, taken, planned.scan.geometry,
                                center_of(planned.plan.field, planned.scan.geometry));
  c.content_sha256 = content_sha256(result.volume);
  return result;
}

int certificate_exit_code(const std::string& who, const Certificate& certificate) {
  if (certificate.comparison) {
    say(fmt::format("{}: a volume for comparison: nothing is certified\n", who));
    return 1;
  }
  if (!certificate.holds_image3d || *certificate.holds_image3d) return 0;
  say(
      fmt::format("{}: the certificate holds for the sampler 'buffer', but not for 'image3d' of this device; "
                  "render with "
                  "--sampler buffer, or ask for a larger epsilon\n",
                  who));
  return 1;
}

}  // namespace vdvr::cli
