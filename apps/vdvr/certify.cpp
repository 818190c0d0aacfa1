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

std::optional<PictureWanted> pictures_wanted(const Arguments& args) {
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
  PictureWanted out;
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
  w.pictures = pictures_wanted(args);
  w.sigmas = sigmas_option(args);
  const bool given = args.has("epsilon") || args.has("epsilon-abs");
  w.chosen_by_noise = may_choose_tolerance && !given && !w.pictures;
  if (w.pictures && !given) w.tolerance = Tolerance{everywhere_of_pictures, {}};
  else if (w.sigmas) refuse(args, {"epsilon-abs"}, "excludes --epsilon");
  else if (!w.chosen_by_noise) w.tolerance = tolerance(args);
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
  wanted.options.plan.foresee = false;
  wanted.compression = compression(args);
  return wanted;
}

namespace {

constexpr double percent_where_noise_is_not_known = 0.03;

// The noise of the scan, and the tolerance where it depends on that.
void choose_tolerance(Planned& planned, Wanted& wanted, const Arguments& args) {
  if (!wanted.sigmas && !wanted.chosen_by_noise && !wanted.noted_noise) return;
  planned.noise = noise_of_scan(args.path("IN"), args, wanted.options.field, planned.scan);
  const auto& noise = planned.noise.noise;
  if (wanted.chosen_by_noise && noise && noise->agreed) {
    wanted.sigmas = 1;
    planned.chosen = "1sigma, the noise of the scan itself: " + noise->words;
  } else if (wanted.chosen_by_noise) {
    wanted.tolerance = Tolerance{percent_where_noise_is_not_known, {}};
    planned.chosen = "3 % of the range, since " +
                     (noise ? "two sources do not agree on the noise: " + noise->words : planned.noise.why);
  }
  planned.sigmas = wanted.sigmas;
  if (wanted.sigmas && !noise)
    throw InputError(fmt::format(
        "{}: --epsilon in sigma needs the scan's noise, and none is known: {}; state it by --photons or "
        "--sigma-p, or give a tolerance such as --epsilon 3%",
        args.path("IN").string(), planned.noise.why));
}

// Beside a tolerance of another kind sigma is told where it can be had; no build fails for it.
std::optional<BrickSigma> noted_sigma(Device& device, Planned& planned, const Progress& progress) {
  if (!planned.noise.noise) return std::nullopt;
  try {
    return sigma_of_plan(device, planned.scan, planned.plan, *planned.noise.noise, progress);
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::interrupted) throw;
    planned.noise.why = e.what();
    return std::nullopt;
  }
}

}  // namespace

Planned read_and_plan(Device& device, const Arguments& args, const Wanted& asked, const Progress& progress,
                      const std::function<void(const Planned&)>& seen) {
  Wanted wanted = asked;
  Planned planned;
  planned.scan = load_scan(args.path("IN"), args, wanted.options.field, progress, &planned.understood);
  choose_tolerance(planned, wanted, args);
  if (seen) seen(planned);
  if (wanted.sigmas) try {
      PlanInSigma made = make_plan_in_sigma(device, planned.scan, *wanted.sigmas, *planned.noise.noise,
                                            wanted.options, progress);
      planned.plan = std::move(made.plan);
      planned.sigma = std::move(made.sigma);
      return planned;
    } catch (const ToleranceError& e) {
      if (!wanted.chosen_by_noise) throw;
      wanted.tolerance = Tolerance{percent_where_noise_is_not_known, {}};
      planned.sigmas.reset();
      say(fmt::format("{}: one sigma of this scan is out of reach ({}); takes 3 % of the range\n", args.who(),
                      e.what()));
    }
  if (!wanted.pictures) {
    planned.plan = make_plan(device, planned.scan, wanted.tolerance, wanted.options, progress);
    planned.sigma = noted_sigma(device, planned, progress);
    return planned;
  }
  CertifyOptions options = wanted.options;
  options.plan.everywhere = wanted.tolerance;
  // Pictures are of the whole grid, so a part of the scan does not do.
  options.plan.estimate = false;
  planned.plan = make_plan(device, planned.scan, Tolerance{wanted.pictures->finest, {}}, options, progress);
  everywhere_of(planned, wanted);
  planned.pictures =
      std::make_shared<PictureRefinement>(wanted.pictures->views, planned.scan, planned.plan.field,
                                          refinement_options(planned, wanted), progress);
  planned.sigma = noted_sigma(device, planned, progress);
  return planned;
}

PictureRefinementOptions refinement_options(const Planned& planned, const Wanted& wanted) {
  PictureRefinementOptions options;
  options.levels = wanted.pictures->levels;
  options.finest_abs = planned.plan.epsilon_abs;
  return options;
}

double everywhere_of(const Planned& planned, const Wanted& wanted) {
  const Plan& plan = planned.plan;
  const double everywhere = wanted.tolerance.absolute.value_or(wanted.tolerance.relative.value_or(1) *
                                                               (plan.epsilon_abs / plan.epsilon));
  if (!(everywhere >= plan.epsilon_abs))
    throw InputError(
        fmt::format("--epsilon {:.4g} lies below {:.4g}, the least that --picture-finest asks of a brick",
                    everywhere, plan.epsilon_abs));
  return everywhere;
}

BuildResult build_planned(Device& device, Planned& planned, const Wanted& wanted, const Progress& progress) {
  CertifyOptions options = wanted.options;
  options.input = planned.understood.stated;
  if (planned.pictures)
    options.build.refinement = planned.pictures->refinement(everywhere_of(planned, wanted));
  else if (planned.sigmas) options.build.refinement = refinement_in_sigma(*planned.sigma, *planned.sigmas);
  BuildResult result = certify(device, planned.scan, std::move(planned.plan), options, progress);
  if (planned.pictures) planned.pictures->note(result.certificate);
  if (planned.sigma)
    note_noise(device, planned.scan, result, *planned.noise.noise, *planned.sigma, planned.sigmas, progress);
  return result;
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
  if (!planned.pictures || planned.pictures->rounds().empty()) return nullptr;
  Json rounds = Json::array();
  for (const PictureRound& r : planned.pictures->rounds())
    rounds.push_back(
        {{"worst", r.worst}, {"mean", r.mean}, {"over", r.over}, {"samples", r.samples}, {"asked", r.asked}});
  return {{"met", planned.pictures->met()},
          {"worst", planned.pictures->rounds().back().worst},
          {"rounds", rounds}};
}

void print_pictures(const Planned& planned) {
  if (!planned.pictures || planned.pictures->rounds().empty()) return;
  const auto& rounds = planned.pictures->rounds();
  fmt::print(
      "pictures       {} view(s): worst pixel {:.1f} levels, mean {:.2f}, {:.2f} % above; {} rounds from "
      "{:.1f}\n",
      planned.pictures->views().cameras.size(), rounds.back().worst, rounds.back().mean,
      100 * rounds.back().over, rounds.size(), rounds.front().worst);
}

int pictures_exit_code(const std::string& who, const Planned& planned) {
  if (!planned.pictures || planned.pictures->met()) return 0;
  say(fmt::format(
      "{}: pictures are not within the tolerance: the worst pixel is certain to {:.1f} levels; a smaller "
      "--picture-finest lets bricks go further\n",
      who, planned.pictures->rounds().empty() ? 255.0 : planned.pictures->rounds().back().worst));
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
