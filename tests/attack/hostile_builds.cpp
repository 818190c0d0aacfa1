// Hostile builds from seeds, over the decades of float32: each a scan made to break bounds, in units from
// 1e-12 to 1e12 and densities from 1e-36 to 1e36, built, and its certificate held to the truth in double
// (tests/support/hostile_check.hpp). CTest runs a short form; scripts/hostile-builds runs thousands in many
// processes and names the seed of one that died.
//   hostile_builds COUNT [FIRST_SEED] [--json] [--verbose] [--cone]

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/support/hostile_check.hpp"
#include "tests/support/hostile_cone.hpp"
#include "tests/support/seed_arguments.hpp"

using namespace vdvr;
using namespace vdvr::hostile;

namespace {

const char* name_of(StorageChoice s) {
  return s == StorageChoice::automatic ? "auto"
         : s == StorageChoice::f32     ? "f32"
         : s == StorageChoice::u16     ? "u16"
                                       : "u8";
}

// What a reader needs to know of a case; the seed alone makes it again.
std::string text_of_case(const Case& c) {
  const auto rate = [](const std::optional<int>& n) { return n ? std::to_string(*n) : std::string("auto"); };
  std::string text =
      c.name + "; grid " + std::to_string(c.grid.cells[0]) + "x" + std::to_string(c.grid.cells[1]) + "x" +
      std::to_string(c.grid.cells[2]) + " of " + detail::text_of(c.grid.spacing) + " px at " +
      detail::text_of(c.grid.origin) + "; upsampling " + rate(c.rates.upsampling) + " " +
      (c.rates.interpolation ? text_of(*c.rates.interpolation) : "auto") + ", gold " + rate(c.rates.gold) +
      ", " + text_of(c.settings.comparison.coefficients) + ", " + text_of(c.settings.levels) + ", closing " +
      text_of(c.settings.comparison.closing) + ", granularity " + std::to_string(c.settings.granularity) +
      ", storage " + name_of(c.options.storage) + ", " + text_of(c.field.filter) + " " +
      detail::text_of(c.field.cutoff);
  if (const auto& base = c.settings.coarsening)
    text += ", base " + std::to_string(1 << (*base)[2]) + "x" + std::to_string(1 << (*base)[1]) + "x" +
            std::to_string(1 << (*base)[0]);
  if (c.options.roi) text += ", roi";
  if (c.sigma_seed) text += ", in sigma";
  if (c.window) text += ", window";
  text += c.against == Against::absolute  ? ", absolute"
          : c.against == Against::largest ? ", of the largest"
                                          : "";
  return text;
}

nlohmann::ordered_json json_of(std::uint64_t seed, const Case& c, const Report& r, double seconds) {
  nlohmann::ordered_json failures = nlohmann::ordered_json::array();
  for (const Failure& f : r.failures) failures.push_back({{"kind", f.kind}, {"text", f.text}});
  return {{"seed", seed},
          {"outcome", r.outcome.kind},
          {"message", r.outcome.message},
          {"excuse", r.excuse},
          {"pitch", c.scale.pitch_u},
          {"ratio", c.scale.pitch_v / c.scale.pitch_u},
          {"density", c.scale.density},
          {"epsilon", r.epsilon},
          {"error_over_total", r.closest},
          {"error_over_brick", r.closest_brick},
          {"points", r.points},
          {"verified", r.verified},
          {"compared", r.compared},
          {"build_seconds", r.outcome.seconds},
          {"seconds", seconds},
          {"failures", failures},
          {"case", text_of_case(c)}};
}

// For one process: the script makes the tables of many.
struct Table {
  std::map<std::string, int> outcomes, kinds;
  double closest = 0;
  int failing = 0;

  void add(const Report& r) {
    ++outcomes[r.outcome.kind];
    for (const Failure& f : r.failures) ++kinds[f.kind];
    closest = std::max(closest, r.closest);
    failing += !r.failures.empty();
  }
  void print() const {
    for (const auto& [kind, count] : outcomes) std::printf("%s: %d\n", kind.c_str(), count);
    std::printf("largest |V - F| / total: %.4f\n", closest);
    for (const auto& [kind, count] : kinds) std::printf("failed, %s: %d\n", kind.c_str(), count);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const auto arguments = support::seed_arguments(argc, argv, "hostile_builds", true);
  if (!arguments) return 2;
  const auto [first, end, json, verbose, cone] = *arguments;

  Device device;
  Table table;
  for (std::uint64_t seed = first; seed < end; ++seed) {
    const auto start = detail::Clock::now();
    const Case c = cone ? draw_cone(seed) : draw_case(seed);
    if (verbose)
      std::fprintf(stderr, "seed %llu: %s\n", static_cast<unsigned long long>(seed), text_of_case(c).c_str());
    const Report r = run_case(device, c, seed);
    table.add(r);
    if (json) {
      std::printf("%s\n", json_of(seed, c, r, detail::since(start)).dump().c_str());
    } else {
      for (const Failure& f : r.failures)
        std::printf("seed %llu, pitch %.3g, ratio %.3g, density %.3g, epsilon %.4g: %s: %s; %s\n",
                    static_cast<unsigned long long>(seed), c.scale.pitch_u, c.scale.pitch_v / c.scale.pitch_u,
                    c.scale.density, r.epsilon, f.kind.c_str(), f.text.c_str(), text_of_case(c).c_str());
    }
    std::fflush(stdout);  // a later crash must not take it along
  }
  if (!json) table.print();
  return table.failing == 0 ? 0 : 1;
}
