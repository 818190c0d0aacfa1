// Measures a stored certificate again (docs/error-bounds.md, "What verify does"). Shares with build only the
// sampler header and what describes the scan: view weights, ramp kernel, covered region.
#include "vdvr/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "host/sampler_terms.hpp"
#include "host/verify_claims.hpp"
#include "host/verify_field.hpp"
#include "host/verify_seams.hpp"
#include "vdvr/error.hpp"
#include "vdvr/exact_field.hpp"
#include "vdvr/reconstruct.hpp"

namespace vdvr {
namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

Index3 place_of(const MixedVolume& v, std::int64_t brick) {
  const Index3 n = v.bricks();
  return {brick % n[0], brick / n[0] % n[1], brick / n[0] / n[1]};
}

bool meets(const MixedVolume& v, std::int64_t brick, const std::array<double, 6>& roi) {
  const Index3 p = place_of(v, brick);
  for (std::size_t a = 0; a < 3; ++a) {
    const double low = v.grid.origin[a] + static_cast<double>(p[a] * v.granularity) * v.grid.spacing[a];
    const double high =
        v.grid.origin[a] +
        static_cast<double>(std::min(v.grid.cells[a], (p[a] + 1) * v.granularity)) * v.grid.spacing[a];
    if (high < roi[a] || low > roi[a + 3]) return false;
  }
  return true;
}

// The layers of bricks a sample is drawn from: each costs the filtered rows of its heights, so they are few.
// The certificate's worst node is in one of them, the others are spread over the volume.
std::vector<std::int64_t> layers_to_sample(std::int64_t count, std::int64_t worst, std::mt19937& random) {
  constexpr std::int64_t most = 3;
  std::vector<std::int64_t> layers{worst};
  const std::int64_t others = std::min(count, most) - 1;
  for (std::int64_t i = 0; i < others; ++i) {
    const std::int64_t first = i * count / others, last = (i + 1) * count / others - 1;
    const std::int64_t layer =
        std::uniform_int_distribution<std::int64_t>(first, std::max(first, last))(random);
    if (std::find(layers.begin(), layers.end(), layer) == layers.end()) layers.push_back(layer);
  }
  return layers;
}

// Every brick, or for each level the wanted share of its bricks and the one that holds the certificate's
// worst node.
std::vector<std::uint8_t> chosen_bricks(const MixedVolume& v, const Certificate& stored,
                                        const VerifyOptions& options) {
  const std::size_t n = v.level.size();
  std::vector<std::uint8_t> selected(n, options.exhaustive ? 1 : 0);
  const auto wanted_by_roi = [&](std::size_t i) {
    return !stored.roi || meets(v, static_cast<std::int64_t>(i), *stored.roi);
  };
  if (!options.exhaustive) {
    const Index3 counts = v.bricks(), worst = brick_at(v, stored.worst_at);
    std::mt19937 random(options.seed);
    std::vector<std::int64_t> layers = layers_to_sample(counts[2], worst[2], random);
    std::map<LevelTriple, std::vector<std::size_t>> strata;
    for (const std::int64_t z : layers)
      for (std::int64_t i = z * counts[0] * counts[1]; i < (z + 1) * counts[0] * counts[1]; ++i)
        if (wanted_by_roi(at(i))) strata[v.level[at(i)]].push_back(at(i));
    const double share =
        options.fraction * static_cast<double>(counts[2]) / static_cast<double>(layers.size());
    for (auto& [level, members] : strata) {
      std::shuffle(members.begin(), members.end(), random);
      const auto wanted = std::max<std::size_t>(
          8, static_cast<std::size_t>(std::ceil(share * static_cast<double>(members.size()))));
      for (std::size_t i = 0; i < std::min(wanted, members.size()); ++i) selected[members[i]] = 1;
    }
    selected[at((worst[2] * counts[1] + worst[1]) * counts[0] + worst[0])] = 1;
  }
  for (std::size_t i = 0; i < n; ++i)
    if (!wanted_by_roi(i)) selected[i] = 0;
  return selected;
}

// The corner of a gold cell where V is farthest from F, and the stored sample nearest to it.
SamplePlace worst_sample(const MixedVolume& v, const ExactField& field, std::int64_t brick,
                         const Index3& cell) {
  const Index3 b = place_of(v, brick);
  const BrickSamples stored(v, b);
  SamplePlace p;
  p.brick = brick;
  p.brick_at = b;
  p.level = v.level[at(brick)];
  const bool base = p.level == LevelTriple{0, 0, 0};
  const std::array<int, 3> levels = stored.level();
  const Index3 in_base = first_base_sample(v, b);
  std::vector<Vec3> points;
  std::vector<double> values;
  std::vector<Index3> nodes;
  for (std::int64_t corner = 0; corner < 8; ++corner) {
    std::array<float, 3> at_cell{};
    Vec3 world{};
    Index3 node{};
    for (std::size_t a = 0; a < 3; ++a) {
      node[a] = cell[a] + (corner >> a & 1);
      const double c = static_cast<double>(b[a] * v.granularity) + static_cast<double>(node[a]) / v.rate;
      at_cell[a] = static_cast<float>(c);
      world[a] = v.grid.origin[a] + c * v.grid.spacing[a];
    }
    nodes.push_back(node);
    points.push_back(world);
    values.push_back(static_cast<double>(stored.at(at_cell[0], at_cell[1], at_cell[2])));
  }
  const std::vector<double> F = field.at(points);
  std::size_t worst = 0;
  for (std::size_t i = 1; i < 8; ++i)
    if (std::abs(values[i] - F[i]) > std::abs(values[worst] - F[worst])) worst = i;
  p.world = points[worst];
  p.value = values[worst];
  p.field = F[worst];
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t per_sample = std::int64_t{v.rate} << v.coarsening[2 - a] >> levels[a];
    p.sample[a] = (nodes[worst][a] + per_sample / 2) / per_sample + (base ? in_base[a] : 0);
  }
  p.dataset = "/base";
  if (!base) {
    const StoredTile tile = stored_tile(v, at(brick));
    p.dataset = fmt::format("/tiles/{}{}{}", p.level[0], p.level[1], p.level[2]);
    if (tile.kind.part > 0) p.dataset += fmt::format("_{}", tile.kind.part);
    p.tile = static_cast<std::uint32_t>(tile.number);
  }
  return p;
}

std::string place_text(const SamplePlace& p) {
  const std::string where = p.dataset == "/base" ? p.dataset : fmt::format("{} tile {}", p.dataset, p.tile);
  return fmt::format(
      "at ({:.4f}, {:.4f}, {:.4f}), where V is {:.6g} and F {:.6g}: brick {} of level ({}, {}, {}), {} "
      "sample ({}, {}, {}) (z, y, x)",
      p.world[0], p.world[1], p.world[2], p.value, p.field, p.brick, p.level[0], p.level[1], p.level[2],
      where, p.sample[2], p.sample[1], p.sample[0]);
}

// Which samplers must hold: those promised that this device has.
void judge(const Certificate& stored, const SamplerTerms& sampler, VerifyResult& r) {
  r.total_buffer = r.measured_total + sampler.buffer.value;
  if (sampler.image3d) r.total_image3d = r.measured_total + sampler.image3d->value;
  r.total = r.total_buffer;
  if (stored.holds_buffer) r.holds_buffer = r.total_buffer <= stored.epsilon_abs;
  if (stored.holds_image3d.value_or(false) && r.total_image3d) {
    r.holds_image3d = *r.total_image3d <= stored.epsilon_abs;
    r.total = std::max(r.total, *r.total_image3d);
  }
  if (!r.holds_buffer && !r.holds_image3d) r.failure = "the certificate holds for no sampler of this device";
  else r.holds = r.holds_buffer.value_or(true) && r.holds_image3d.value_or(true);
}

// The sampler terms again, and the least that an image sampler can have.
Differences check_samplers(Device& device, const MixedVolume& volume, const Certificate& stored,
                           const FieldSlopes& slopes, const SamplerTerms& found) {
  SamplerProbe ideal;
  ideal.image3d = ideal.u16.image3d = ideal.u8.image3d = true;
  const SamplerTerms least = sampler_terms(slopes, volume.grid, ideal, 1, stored.epsilon_abs, volume.rate);
  const bool same_device = device.info().name == stored.device && device.info().driver == stored.driver;
  return compare_samplers(found, least, same_device, stored);
}

// Adds what differs to the verdict.
void add_differences(VerifyResult& r) {
  if (r.differences.empty()) return;
  r.holds = false;
  for (std::size_t i = 0; i < r.differences.size(); ++i)
    r.failure +=
        fmt::format("{}{}", r.failure.empty() ? "the certificate is not that of these projections: " : "; ",
                    r.differences[i]);
}

}  // namespace

VerifyResult verify(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                    const Certificate& stored, const VerifyOptions& options, const Progress& progress) {
  opencl::State& state = device.state();
  ParallelGeometry used = scan.geometry;
  if (stored.field.center) used.center = *stored.field.center;
  check_scan(used);
  const std::uint64_t bytes = static_cast<std::uint64_t>(scan.size()) * sizeof(double);
  state.memory.take(bytes, "cosine coefficients of the filtered projections");
  struct Give {
    opencl::State& state;
    std::uint64_t bytes;
    ~Give() { state.memory.give(bytes); }
  } const give{state, bytes};
  const ExactField exact(scan, stored.field, progress);
  const FieldSlopes slopes = field_slopes(volume);
  const SamplerTerms sampler =
      sampler_terms(slopes, volume.grid, probe_sampler(device), atlas_length(device.info(), volume),
                    stored.epsilon_abs, volume.rate);

  VerifyResult result;
  result.differences = compare_scope(scan, used, volume, stored);
  const auto also = [&](Differences more) {
    result.differences.insert(result.differences.end(), std::make_move_iterator(more.begin()),
                              std::make_move_iterator(more.end()));
  };
  also(check_samplers(device, volume, stored, slopes, sampler));
  const std::vector<std::uint8_t> selected = chosen_bricks(volume, stored, options);
  TotalAttack attack(volume, stored);
  result.epsilon_abs = stored.epsilon_abs;
  result.bricks = static_cast<std::int64_t>(volume.level.size());
  std::int64_t worst = -1, broken = -1;
  Index3 worst_cell{}, broken_cell{};
  {
    VerifyField field(state, exact, volume, stored.window, progress);
    field.run(
        selected,
        [&](const VerifyField::Brick& b) {
          if (b.total < 0) return;
          attack.consider(b);
          ++result.bricks_tested;
          result.cells_tested += b.cells;
          result.nodes_tested += b.nodes;
          result.measured_max = std::max(result.measured_max, b.error);
          if (!stored.brick_totals.empty() &&
              !(b.error - field.arithmetic() <=
                static_cast<double>(stored.brick_totals[at(b.brick)]) + stored.budget.arithmetic.value)) {
            broken = b.brick;
            broken_cell = b.worst_cell;
          }
          if (b.total <= result.measured_total && worst >= 0) return;
          result.measured_total = b.total;
          worst = b.brick;
          worst_cell = b.worst_cell;
        },
        progress);
    result.arithmetic = field.arithmetic();
  }
  if (worst < 0) {
    result.failure = "no tested brick holds a covered gold cell";
    add_differences(result);
    return result;
  }
  result.worst = worst_sample(volume, exact, worst, worst_cell);
  result.worst_at = result.worst.world;
  judge(stored, sampler, result);
  if (!result.holds && result.failure.empty())
    result.failure = fmt::format("|V - F| may reach {:.6g} > epsilon {:.6g} {}", result.total,
                                 stored.epsilon_abs, place_text(result.worst));
  // Nodes are where V is certified without T: no total can lie below what is measured there.
  const double promised = std::max(stored.total_buffer, stored.total_image3d.value_or(stored.total_buffer));
  if (result.holds && !(result.measured_max - result.arithmetic <= promised)) {
    result.holds = false;
    result.failure = fmt::format("|V - F| reaches {:.6g}, above the total {:.6g} of the certificate, {}",
                                 result.measured_max, promised, place_text(result.worst));
  }
  if (result.holds && broken >= 0) {
    result.holds = false;
    result.failure = fmt::format("|V - F| exceeds the certificate's bound {:.6g} of one brick, {}",
                                 stored.brick_totals[at(broken)],
                                 place_text(worst_sample(volume, exact, broken, broken_cell)));
  }
  const TotalAttack::Outcome points = attack.run(exact, progress);
  result.points_evaluated = points.points;
  result.worst_share = points.worst_share;
  if (result.holds && !points.failure.empty()) {
    result.holds = false;
    result.failure = points.failure;
  }
  // Rates that name no gold have been found already.
  if (result.differences.empty())
    also(compare_terms(device, scan, exact, volume, stored, selected, options.exhaustive, progress));
  add_differences(result);
  if (options.exhaustive) {
    const Seams seams = compare_seams(volume);
    result.seams = seams.different;
    if (seams.different > 0) {
      result.holds = false;
      result.failure += fmt::format(
          "{}{} samples that two bricks share differ, first at ({:.4f}, {:.4f}, {:.4f}) between bricks {} "
          "and {}",
          result.failure.empty() ? "" : "; ", seams.different, seams.at[0], seams.at[1], seams.at[2],
          seams.bricks[0], seams.bricks[1]);
    }
  }
  return result;
}

}  // namespace vdvr
