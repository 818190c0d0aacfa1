// A long day in one process: builds, files written and read, frames, refused files. Memory and open files
// must stay where they are once warm. CTest runs a short form; `build/tests/soak 200 2000` the long one.
#include <malloc.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/scans.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/raycast.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/vdvr_file.hpp"

namespace fs = std::filesystem;
using namespace vdvr;

namespace {

struct Held {
  double mib = 0;
  std::int64_t files = 0;
};

Held held_now() {
  ::malloc_trim(0);  // what the C library keeps for later is no leak
  std::uint64_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return {static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1048576.0,
          std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator())};
}

// One scan written, read, built, written, read and compared; and a damaged file refused.
VdvrFile build_once(Device& device, const support::TemporaryFolder& folder, const ProjectionSet& made) {
  write_data_exchange(folder / "scan.h5", made);
  const ProjectionSet scan = read_scan(folder / "scan.h5");
  GridOptions grid;
  const Plan plan = make_plan(device, scan, make_grid(scan.geometry, grid), {}, {}, {0.2, {}}, {});
  BuildResult result = build(device, scan, plan, {});
  write_vdvr(folder / "o.vdvr", result.volume, result.certificate);
  fs::resize_file(folder / "scan.h5", fs::file_size(folder / "scan.h5") / 2);
  try {
    static_cast<void>(read_scan(folder / "scan.h5"));
    throw std::logic_error("half a scan was read");
  } catch (const FileError&) {
  }
  return read_vdvr(folder / "o.vdvr");
}

bool flat(const char* what, const Held& warm, const Held& end, int count) {
  // Twelve pages a round would be a leak; below that the heap's and the driver's own fragmentation shows.
  const double allowed_mib = 8 + 0.047 * count;
  std::printf("%d %s: %.1f MiB and %ld files when warm, %.1f MiB and %ld files at the end\n", count, what,
              warm.mib, static_cast<long>(warm.files), end.mib, static_cast<long>(end.files));
  const bool good = end.mib - warm.mib <= allowed_mib && end.files <= warm.files;
  if (!good)
    std::printf("  that is no flat line: at most %.1f MiB more are allowed, and no file\n", allowed_mib);
  return good;
}

}  // namespace

int main(int argc, char** argv) {
  const int builds = argc > 1 ? std::atoi(argv[1]) : 12, frames = argc > 2 ? std::atoi(argv[2]) : 100;
  const support::TemporaryFolder folder;
  Device device;
  const ProjectionSet scan = vdvr::testing::noise_scan(12, 3, 13);
  Held warm;
  std::string hash;
  bool good = true;
  for (int i = 0; i < builds; ++i) {
    const VdvrFile file = build_once(device, folder, scan);
    const std::string now = content_sha256(file.volume);
    if (!hash.empty() && now != hash) {
      std::printf("build %d gives another content: %s, not %s\n", i, now.c_str(), hash.c_str());
      good = false;
    }
    hash = now;
    if (i == builds / 4) warm = held_now();
  }
  good = flat("builds", warm, held_now(), builds) && good;

  const VdvrFile file = read_vdvr(folder / "o.vdvr");
  for (int i = 0; i < frames; ++i) {
    // A volume uploaded anew now and then, as a viewer opens files.
    RenderOptions options;
    options.transfer = transfer_preset("marschner-lobb", 0, 1);
    options.width = options.height = 32;
    options.sampler = i % 2 == 0 ? SamplerKind::buffer : SamplerKind::automatic;
    const ResidentVolume volume(device, file.volume);
    static_cast<void>(raycast(device, volume, options));
    if (i == frames / 4) warm = held_now();
  }
  good = flat("frames", warm, held_now(), frames) && good;
  return good ? 0 : 1;
}
