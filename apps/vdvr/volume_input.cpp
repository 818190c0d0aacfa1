#include "apps/vdvr/volume_input.hpp"

#include <optional>

#include "apps/vdvr/options.hpp"
#include "vdvr/expert/volume_file.hpp"

namespace vdvr::cli {

void add_volume_input(Arguments& args) {
  args.value("nan-as", "V", "of a uniform volume: read samples that are no finite numbers as V");
}

Volume load_volume(const std::filesystem::path& path, const Arguments& args) {
  std::optional<double> nan_as;
  if (args.has("nan-as")) nan_as = args.number_or("nan-as", 0);
  return read_volume(path, common_options(args).max_memory, nan_as);
}

}  // namespace vdvr::cli
