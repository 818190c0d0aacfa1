#include "apps/vdvr/certify.hpp"

#include <fmt/format.h>

#include <utility>

#include "apps/common/progress.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/inputs.hpp"
#include "vdvr/error.hpp"
#include "vdvr/output_file.hpp"

namespace vdvr::cli {

void add_plan_options(Arguments& args) {
  add_scan(args);
  add_tolerance(args);
  add_field(args);
  add_grid(args);
  add_rates(args);
}

Wanted wanted_of(const Arguments& args) {
  Wanted w;
  w.options.field = field_options(args);
  w.options.grid = grid_options(args);
  w.options.rates = rate_options(args);
  w.tolerance = tolerance(args);
  w.options.build = build_options(args);
  w.options.plan = plan_settings(args);
  return w;
}

void add_certify_options(Arguments& args) {
  add_plan_options(args);
  add_build(args);
  add_compression(args);
  add_crew(args);
  add_common(args);
}

Wanted wanted_to_certify(const Arguments& args) {
  Wanted wanted = wanted_of(args);
  wanted.options.plan.foresee = false;
  wanted.compression = compression(args);
  return wanted;
}

Planned read_and_plan(Device& device, const Arguments& args, const Wanted& wanted, const Progress& progress) {
  Planned planned;
  planned.scan = load_scan(args.path("IN"), args, wanted.options.field, progress);
  planned.plan = make_plan(device, planned.scan, wanted.tolerance, wanted.options, progress);
  return planned;
}

BuildResult build_planned(Device& device, Planned& planned, const Wanted& wanted, const Progress& progress) {
  return certify(device, planned.scan, std::move(planned.plan), wanted.options, progress);
}

std::filesystem::path journal_path(const std::filesystem::path& output) {
  return output.string() + ".journal";
}

bool continues(const Arguments& args, const std::filesystem::path& output) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(journal_path(output), error);
  return args.has("resume") && ((!error && bytes > 0) || !shares_of(output).empty());
}

std::unique_ptr<Journal> open_journal(const Arguments& args, const CommonOptions& common,
                                      const std::filesystem::path& path) {
  const bool resume = args.has("resume");
  auto journal = std::make_unique<Journal>(path, resume);
  if (!common.quiet && !resume && journal->found())
    say(
        fmt::format("{}: {} is of an unfinished build, which --resume would have continued: it will be "
                    "replaced\n",
                    args.who(), path.string()));
  return journal;
}

Journals open_journals(const Arguments& args, const CommonOptions& common,
                       const std::filesystem::path& output,
                       const std::vector<std::filesystem::path>& outputs) {
  Journals out;
  out.own = open_journal(args, common, journal_path(output));
  for (const auto& file : outputs) io::remove_leftovers(file);
  const auto shares = shares_of(output);
  const bool resume = args.has("resume");
  for (const auto& path : shares)
    if (resume) out.parts.push_back(std::make_unique<Journal>(path, true));
  if (common.quiet) return out;
  if (resume && !shares.empty()) say(fmt::format("{}: joins {} shares\n", args.who(), shares.size()));
  else if (resume && !out.own->found())
    say(fmt::format("{}: {} does not exist: nothing to resume, starting afresh\n", args.who(),
                    out.own->path().string()));
  else if (!shares.empty())
    say(fmt::format("{}: {} and {} more are shares of a build, which --resume would have joined: they stay\n",
                    args.who(), shares.front().string(), shares.size() - 1));
  return out;
}

void Journals::name_in(BuildOptions& build) const {
  build.journal = own.get();
  build.parts.clear();
  for (const auto& part : parts) build.parts.push_back(part.get());
}

void Journals::remove() {
  for (const auto& part : parts) part->remove();
  own->remove();
}

std::int64_t Journals::replayed() const {
  std::int64_t records = own->replayed();
  for (const auto& part : parts) records += part->replayed();
  return records;
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
    throw Interrupted(e.reason(), stays);
  }
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
