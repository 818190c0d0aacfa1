// What programs that run seeds one after another are told: COUNT [FIRST_SEED] [--json] [--verbose], and
// [--cone] where a program has cases of cone beam too.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <vector>

namespace vdvr::support {

struct SeedArguments {
  std::uint64_t first = 1, end = 1;
  bool json = false, verbose = false, cone = false;
};

/// None, and a line on stderr, where they are not understood.
inline std::optional<SeedArguments> seed_arguments(int argc, char** argv, const char* program,
                                                   bool has_cone = false) {
  SeedArguments out;
  std::vector<std::uint64_t> numbers;
  bool understood = true;
  for (int i = 1; i < argc; ++i) {
    char* end = nullptr;
    if (std::strcmp(argv[i], "--json") == 0) out.json = true;
    else if (std::strcmp(argv[i], "--verbose") == 0) out.verbose = true;
    else if (has_cone && std::strcmp(argv[i], "--cone") == 0) out.cone = true;
    else {
      numbers.push_back(std::strtoull(argv[i], &end, 10));
      understood = understood && end != argv[i] && *end == 0;
    }
  }
  if (!understood || numbers.empty() || numbers.size() > 2) {
    std::fprintf(stderr, "usage: %s COUNT [FIRST_SEED] [--json] [--verbose]%s\n", program,
                 has_cone ? " [--cone]" : "");
    return std::nullopt;
  }
  if (numbers.size() > 1) out.first = numbers[1];
  out.end = out.first + numbers[0];
  return out;
}

}  // namespace vdvr::support
