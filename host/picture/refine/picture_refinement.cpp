// Volumes of a build, round by round, and what the certificate says of them.
#include "vdvr/expert/picture_refinement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/field/fdk/filter_cone.hpp"
#include "host/picture/refine/picture_rounds.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certificate.hpp"

namespace vdvr {
namespace {

std::uint64_t samples_of(const MixedVolume& volume) {
  std::uint64_t sum = 0;
  for_each_block(volume, [&](const SampleBlock& block) { sum += block.size(); });
  return sum;
}

// For either sampler of the device.
std::vector<float> bounds_of(const Certificate& certificate) {
  std::vector<float> bounds = brick_bounds(certificate, false);
  if (!certificate.budget.sampler.image3d) return bounds;
  const std::vector<float> image = brick_bounds(certificate, true);
  for (std::size_t i = 0; i < bounds.size(); ++i) bounds[i] = std::max(bounds[i], image[i]);
  return bounds;
}

}  // namespace

struct PictureRefinement::Impl {
  Impl(WantedViews of, const ProjectionSet& scan, const FieldOptions& field, PictureRefinementOptions o,
       Progress p)
      : wanted(std::move(of)),
        coverage(certified_coverage(scan, field)),
        options(std::move(o)),
        progress(std::move(p)),
        rounds(options) {}

  std::vector<float> ask(const MixedVolume& volume, const Certificate& certificate);
  WantedViews wanted;
  Coverage coverage;
  PictureRefinementOptions options;
  Progress progress;
  PictureViews views;
  PictureRounds rounds;
};

std::vector<float> PictureRefinement::Impl::ask(const MixedVolume& volume, const Certificate& certificate) {
  views = views_of(wanted, volume);
  const std::vector<float> bounds = bounds_of(certificate);
  const RayField field(volume, bounds, coverage, certificate.roi);
  return rounds.look(field, views, bounds, volume.bricks(), samples_of(volume), progress);
}

PictureRefinement::PictureRefinement(WantedViews views, const ProjectionSet& scan, const FieldOptions& field,
                                     PictureRefinementOptions options, Progress progress)
    : impl_(std::make_unique<Impl>(std::move(views), scan, field, std::move(options), std::move(progress))) {
  if (!(impl_->options.levels > 0 && impl_->options.levels <= 255))
    throw InputError(fmt::format("`picture-tolerance` {} is none of levels of 255: above 0, at most 255",
                                 impl_->options.levels));
}
PictureRefinement::~PictureRefinement() = default;

Refinement PictureRefinement::refinement(double everywhere_abs) {
  return {everywhere_abs,
          {},
          [this](const MixedVolume& volume, const Certificate& certificate) {
            return impl_->ask(volume, certificate);
          },
          fmt::format("pictures {} within {:a}", impl_->wanted.sha256, impl_->options.levels)};
}
const std::vector<PictureRound>& PictureRefinement::rounds() const { return impl_->rounds.rounds(); }
bool PictureRefinement::met() const { return impl_->rounds.met(); }
const PictureViews& PictureRefinement::views() const { return impl_->views; }

void PictureRefinement::note(Certificate& certificate) const {
  if (rounds().empty()) return;
  const PictureRound& last = rounds().back();
  nlohmann::ordered_json options = nlohmann::ordered_json::parse(certificate.options_json);
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array(), points = cameras;
  for (const Camera& c : impl_->views.cameras)
    cameras.push_back({{"position", c.position},
                       {"focal_point", c.focal_point},
                       {"view_up", c.view_up},
                       {"view_angle", c.view_angle_deg}});
  for (const TransferPoint& p : impl_->views.transfer.points)
    points.push_back({{"value", p.value}, {"rgb", p.rgb}, {"opacity", p.opacity}});
  options["pictures"] = {{"levels", impl_->options.levels},
                         {"worst", last.worst},
                         {"met", met()},
                         {"rounds", rounds().size()},
                         {"views_sha256", impl_->wanted.sha256},
                         {"size", {impl_->views.width, impl_->views.height}},
                         {"transfer", points},
                         {"background", {impl_->views.background_top, impl_->views.background_bottom}},
                         {"cameras", cameras}};
  certificate.options_json = options.dump();
  certificate.notes.push_back(fmt::format(
      "refined for {} view(s): bricks that these do not need are coarse, and epsilon says how coarse",
      impl_->views.cameras.size()));
}

}  // namespace vdvr
