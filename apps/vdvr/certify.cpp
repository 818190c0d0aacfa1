#include "apps/vdvr/certify.hpp"

#include <fmt/format.h>

#include <utility>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/inputs.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr::cli {

void add_plan_options(Arguments& args) {
  add_scan(args);
  add_tolerance(args);
  add_noise(args);
  args.group("Pictures")
      .value("picture-tolerance", "N",
             "refine until every pixel of the views is certain to N levels of 255; --epsilon then holds "
             "everywhere (default 25%)")
      .value("picture-views", "VIEWS.json",
             "the cameras, the size and the transfer function of these pictures")
      .value("picture-finest", "0.002|0.2%",
             "the least tolerance that a brick is asked for, of the range (default N / 4000)");
  add_field(args);
  add_grid(args);
  add_rates(args);
}

namespace {

// Where no view looks, a volume is still one: a quarter of the range tells what is there.
constexpr double everywhere_of_pictures = 0.25;
// Levels to a fraction of the range: what a pixel of a sharp transfer function asks of the bricks that it
// sees.
constexpr double levels_to_finest = 4000;

std::optional<PictureTolerance> pictures_wanted(const Arguments& args) {
  if (!args.has("picture-tolerance")) {
    refuse(args, {"picture-views", "picture-finest"}, "goes with --picture-tolerance");
    return std::nullopt;
  }
  if (!has_picture_views(args))
    throw InputError(
        "--picture-tolerance needs --picture-views VIEWS.json: the pictures that it speaks of (--views "
        "VIEWS.json "
        "means the same)");
  if (sigmas_option(args))
    throw InputError(
        "--epsilon in sigma excludes --picture-tolerance: one of the two decides what bricks need");
  refuse(args, {"window"}, "excludes --picture-tolerance: bricks beside the window have no bound");
  PictureTolerance out;
  out.levels = args.positive_or("picture-tolerance", out.levels);
  if (out.levels > 255)
    throw InputError(fmt::format("--picture-tolerance: {} levels, but a pixel has 255", out.levels));
  out.views = read_views(picture_views(args));
  out.finest =
      args.has("picture-finest") ? fraction_option(args, "picture-finest") : out.levels / levels_to_finest;
  return out;
}

}  // namespace

Wanted wanted_of(const Arguments& args, bool may_choose_tolerance) {
  Wanted w;
  w.options.field = field_options(args);
  w.options.grid = grid_options(args);
  w.options.rates = rate_options(args);
  w.asked.pictures = pictures_wanted(args);
  w.asked.sigmas = sigmas_option(args);
  const bool given = args.has("epsilon") || args.has("epsilon-abs");
  w.chosen_by_noise = may_choose_tolerance && !given && !w.asked.pictures;
  if (w.asked.pictures && !given) w.asked.tolerance = Tolerance{everywhere_of_pictures, {}};
  else if (w.asked.sigmas) refuse(args, {"epsilon-abs"}, "excludes --epsilon");
  else if (!w.chosen_by_noise) w.asked.tolerance = tolerance(args);
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

Wanted wanted_to_certify(const Arguments& args, bool may_choose_tolerance) {
  Wanted wanted = wanted_of(args, may_choose_tolerance);
  wanted.options.plan.forecast = false;
  wanted.compression = compression(args);
  return wanted;
}

namespace {

constexpr double percent_where_noise_is_not_known = 0.03;

// The noise of the scan, and the tolerance where it depends on that.
void choose_tolerance(Planned& planned, Wanted& wanted, const Arguments& args) {
  AskedTolerance& asked = wanted.asked;
  if (!asked.sigmas && !wanted.chosen_by_noise && !wanted.noted_noise) return;
  planned.noise = noise_of_scan(args.path("IN"), args, wanted.options.field, planned.scan);
  const auto& noise = planned.noise.noise;
  if (wanted.chosen_by_noise && noise && noise->agreed) {
    asked.sigmas = 1;
    planned.chosen = "1sigma, the noise of the scan itself: " + noise->words;
  } else if (wanted.chosen_by_noise) {
    asked.tolerance = Tolerance{percent_where_noise_is_not_known, {}};
    planned.chosen = "3 % of the range, since " +
                     (noise ? "two sources do not agree on the noise: " + noise->words : planned.noise.why);
  }
  if (asked.sigmas && !noise)
    throw InputError(fmt::format(
        "{}: --epsilon in sigma needs the scan's noise, and none is known: {}; state it by --photons or "
        "--sigma-p, or give a tolerance such as --epsilon 3%",
        args.path("IN").string(), planned.noise.why));
}

}  // namespace

Planned read_and_plan(Device& device, const Arguments& args, const Wanted& asked, const Progress& progress,
                      const std::function<void(const Planned&)>& seen) {
  Wanted wanted = asked;
  Planned planned;
  planned.scan = load_scan(args.path("IN"), args, wanted.options.field, progress, &planned.understood);
  choose_tolerance(planned, wanted, args);
  if (seen) seen(planned);
  const auto plan = [&] {
    return plan_scan(device, planned.scan, wanted.asked, planned.noise.noise, wanted.options, progress);
  };
  try {
    planned.made = plan();
  } catch (const ToleranceError& e) {
    if (!wanted.chosen_by_noise || !wanted.asked.sigmas) throw;
    wanted.asked = {Tolerance{percent_where_noise_is_not_known, {}}, {}};
    say(fmt::format("{}: one sigma of this scan is out of reach ({}); takes 3 % of the range\n", args.who(),
                    e.what()));
    planned.made = plan();
  }
  if (!planned.made.no_sigma.empty()) planned.noise.why = planned.made.no_sigma;
  return planned;
}

BuildResult build_planned(Device& device, Planned& planned, const Wanted& wanted, const Progress& progress) {
  CertifyOptions options = wanted.options;
  options.input = planned.understood.stated;
  return certify_planned(device, planned.scan, planned.made, std::move(options), progress);
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

Json pictures_json(const Planned& planned) {
  if (!planned.made.pictures || planned.made.pictures->rounds().empty()) return nullptr;
  Json rounds = Json::array();
  for (const PictureRound& r : planned.made.pictures->rounds())
    rounds.push_back(
        {{"worst", r.worst}, {"mean", r.mean}, {"over", r.over}, {"samples", r.samples}, {"asked", r.asked}});
  return {{"met", planned.made.pictures->met()},
          {"worst", planned.made.pictures->rounds().back().worst},
          {"rounds", rounds}};
}

void print_pictures(const Planned& planned) {
  if (!planned.made.pictures || planned.made.pictures->rounds().empty()) return;
  const auto& rounds = planned.made.pictures->rounds();
  fmt::print(
      "pictures       {} view(s): worst pixel {:.1f} levels, mean {:.2f}, {:.2f} % above; {} rounds from "
      "{:.1f}\n",
      planned.made.pictures->views().cameras.size(), rounds.back().worst, rounds.back().mean,
      100 * rounds.back().over, rounds.size(), rounds.front().worst);
}

int pictures_exit_code(const std::string& who, const Planned& planned) {
  if (!planned.made.pictures || planned.made.pictures->met()) return 0;
  say(fmt::format(
      "{}: pictures are not within the tolerance: the worst pixel is certain to {:.1f} levels; a smaller "
      "--picture-finest lets bricks go further\n",
      who, planned.made.pictures->rounds().empty() ? 255.0 : planned.made.pictures->rounds().back().worst));
  return 1;
}

int certificate_exit_code(const std::string& who, const Certificate& certificate) {
  if (certificate.comparison) {
    say(fmt::format("{}: a volume for comparison: nothing is certified\n", who));
    return 1;
  }
  if (!certificate.holds_image3d || *certificate.holds_image3d) return 0;
  say(fmt::format(
      "{}: the certificate holds for the sampler 'buffer', with which pictures are drawn, but not "
      "for 'image3d' of this device, which may err by {:.3g}; a larger epsilon leaves room for it\n",
      who, certificate.budget.sampler.image3d->value));
  return 1;
}

}  // namespace vdvr::cli
