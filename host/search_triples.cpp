// The order in which level triples are tried (docs/error-bounds.md, section on level triples).
#include "host/search_triples.hpp"

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

double samples_of(int granularity, const LevelTriple& l) {
  double n = 1;
  for (const std::uint8_t level : l) n *= static_cast<double>((granularity << level) + 1);
  return n;
}

bool is_coarser(const LevelTriple& a, const LevelTriple& b) {
  return a[0] <= b[0] && a[1] <= b[1] && a[2] <= b[2];
}

}  // namespace

TripleSearch::TripleSearch(int granularity, int top, bool anisotropic, bool fitted)
    : top_(std::min(top, AxisErrors::most_levels)), anisotropic_(anisotropic), fitted_(fitted) {
  for (int z = 0; z <= top_; ++z)
    for (int y = 0; y <= top_; ++y)
      for (int x = 0; x <= top_; ++x) {
        const int sum = x + y + z;
        if (sum == 0 || sum == 3 * top_ || (!anisotropic && (x != y || y != z))) continue;
        candidates_.push_back(
            {static_cast<std::uint8_t>(z), static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(x)});
      }
  std::stable_sort(candidates_.begin(), candidates_.end(), [&](const LevelTriple& a, const LevelTriple& b) {
    return samples_of(granularity, a) < samples_of(granularity, b);
  });
}

// Interpolation along one axis after the other: errors of either sign add up. Fitted samples halve them.
float TripleSearch::foreseen(const Brick& brick, const LevelTriple& level) const {
  float plus = 0, minus = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t l = level[2 - a];
    if (static_cast<int>(l) >= top_) continue;
    plus += brick.errors.of[a][l][0];
    minus += brick.errors.of[a][l][1];
  }
  return (fitted_ ? 0.5f : 1.0f) * std::max(plus, minus);
}

std::optional<LevelTriple> TripleSearch::next(const Brick& brick, float tolerance) const {
  for (const LevelTriple& level : candidates_) {
    const bool isotropic = level[0] == level[1] && level[1] == level[2];
    if (brick.failed.size() >= most_failures && !isotropic) continue;
    const bool hopeless = std::any_of(brick.failed.begin(), brick.failed.end(),
                                      [&](const LevelTriple& f) { return is_coarser(level, f); });
    if (hopeless) continue;
    if (!anisotropic_ || brick.failed.size() >= most_failures ||
        slack_share * brick.slack + first_scale * brick.scale * foreseen(brick, level) <= tolerance)
      return level;
  }
  return std::nullopt;
}

void TripleSearch::fail(Brick& brick, const LevelTriple& level, float total) const {
  brick.failed.push_back(level);
  const float expected = first_scale * foreseen(brick, level);
  if (expected > 0)
    brick.scale = std::max(brick.scale, std::min((total - slack_share * brick.slack) / expected, 2.0f));
}

}  // namespace vdvr
