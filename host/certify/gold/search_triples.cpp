// The order in which level triples are tried (docs/error-bounds.md, section on level triples).
#include "host/certify/gold/search_triples.hpp"

#include <algorithm>

namespace vdvr {
namespace {

// A brick's first guess is a little hopeful: a triple too cheap costs one more test, one too dear its
// samples.
constexpr float first_scale = 0.9f;
// Of the slack: fitted samples aim at the middle of where F may lie, which leaves half to either side.
constexpr float slack_share = 0.5f;
// A brick whose errors are no sum over axes is hard to guess; after so many failures only isotropic levels
// are left.
constexpr std::size_t most_failures = 4;

bool is_coarser(const LevelTriple& a, const LevelTriple& b) {
  return a[0] <= b[0] && a[1] <= b[1] && a[2] <= b[2];
}

}  // namespace

TripleSearch::TripleSearch(const GoldSettings& settings, bool proposing)
    : coarsening_(settings.coarsening),
      top_(settings.finest()),
      anisotropic_(settings.anisotropic),
      fitted_(settings.midrange) {
  for (std::uint8_t& top : top_) top = std::min<std::uint8_t>(top, AxisErrors::most_levels);
  LevelTriple l{};
  for (l[0] = 0; l[0] <= top_[0]; ++l[0])
    for (l[1] = 0; l[1] <= top_[1]; ++l[1])
      for (l[2] = 0; l[2] <= top_[2]; ++l[2])
        if (l != LevelTriple{0, 0, 0} && l != top_ && (anisotropic_ || is_isotropic(l)) &&
            !(proposing && (l[0] == top_[0] || l[1] == top_[1] || l[2] == top_[2])))
          candidates_.push_back(l);
  const MixedVolume shape{settings.grid, settings.granularity, settings.rate, coarsening_, {}, {}, {}, {}, 0};
  std::stable_sort(candidates_.begin(), candidates_.end(), [&](const LevelTriple& a, const LevelTriple& b) {
    return shape.tile_size(a) < shape.tile_size(b);
  });
}

// As many samples a cell along every axis.
bool TripleSearch::is_isotropic(const LevelTriple& l) const {
  return l[0] - coarsening_[0] == l[1] - coarsening_[1] && l[1] - coarsening_[1] == l[2] - coarsening_[2];
}

// Interpolation along one axis after the other: errors of either sign add up. Fitted samples halve them.
float TripleSearch::forecast(const Brick& brick, const LevelTriple& level) const {
  float plus = 0, minus = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t l = level[2 - a];
    if (l >= top_[2 - a]) continue;
    plus += brick.errors.of[a][l][0];
    minus += brick.errors.of[a][l][1];
  }
  return (fitted_ ? 0.5f : 1.0f) * std::max(plus, minus);
}

std::optional<LevelTriple> TripleSearch::next(const Brick& brick, float tolerance) const {
  for (const LevelTriple& level : candidates_) {
    if (brick.failed.size() >= most_failures && !is_isotropic(level)) continue;
    const bool hopeless = std::any_of(brick.failed.begin(), brick.failed.end(),
                                      [&](const LevelTriple& f) { return is_coarser(level, f); });
    if (hopeless) continue;
    if (!anisotropic_ || brick.failed.size() >= most_failures ||
        slack_share * brick.slack + first_scale * brick.scale * forecast(brick, level) <= tolerance)
      return level;
  }
  return std::nullopt;
}

void TripleSearch::fail(Brick& brick, const LevelTriple& level, float total) const {
  brick.failed.push_back(level);
  const float expected = first_scale * forecast(brick, level);
  if (expected > 0)
    brick.scale = std::max(brick.scale, std::min((total - slack_share * brick.slack) / expected, 2.0f));
}

}  // namespace vdvr
