// The certified volume from a scan: gold stream, classification, closing, packing, verification on the packed
// field.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/crew.hpp"
#include "vdvr/expert/journal.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/plan.hpp"

namespace vdvr {

/// Part `part` of `parts`, counted from 1, of the blocks that a build classifies.
struct BuildShare {
  int part = 1, parts = 1;
};

/// Refinement where something asks for it: bricks begin at a tolerance that holds everywhere, or at their
/// own, and are brought within a smaller one, round by round, as whoever looks at the volume asks. The plan's
/// epsilon is then the smallest tolerance that can be asked for, since its rates suit that one.
struct Refinement {
  double everywhere_abs = 0;  ///< density units, no less than the plan's epsilon_abs
  /// [bz][by][bx] what |V - F| may be in each brick from the start, world units; empty: everywhere_abs.
  std::vector<float> by_brick;
  /// Given a measured volume and its certificate, in world units: [bz][by][bx] what |V - F| may be at most,
  /// or nothing where the volume will do. Called again once bricks are within it, or within the plan's
  /// epsilon.
  std::function<std::vector<float>(const MixedVolume&, const Certificate&)> ask;
  std::string digest;  ///< of what `ask` goes by: a journal is of one
};

struct BuildOptions {
  std::optional<std::array<double, 6>> roi;  ///< x0,y0,z0,x1,y1,z1: certify the points of this closed box
                                             ///< only; what that does to the grid, certify.hpp says
  std::optional<std::pair<double, double>> window;  ///< test only gold cells whose range meets [lo, hi]
  StorageChoice storage = StorageChoice::automatic;
  /// What may lie in memory of the tiles before closing, and of a closed volume; what takes more lies in
  /// scratch, beside the scan if that does. None: an eighth of the device's limit; all where it has none.
  std::optional<std::uint64_t> in_memory_bytes{};
  std::filesystem::path scratch;  ///< folder of scratch; empty: the default (scratch.hpp)
  /// Keeps what is finished, block by block, and knows what an earlier process finished. Not owned; build()
  /// calls begin() and leaves it to the caller to remove() it once the result is stored.
  Journal* journal = nullptr;
  std::optional<Refinement> refinement{};  ///< none: the plan's epsilon everywhere; excludes `window`
  /// Of shares, to be joined: what they hold is not computed again. Not owned.
  std::vector<Journal*> parts{};
  CrewOptions crew{};  ///< who else computes
};

struct BuildResult {
  MixedVolume volume;
  /// Of a plan whose comparison is never certified: the record of one, which promises nothing.
  Certificate certificate;
  std::map<std::string, double> seconds;  ///< per stage
  std::uint64_t message_bytes = 0;        ///< to and from other processes
  double message_seconds = 0;             ///< the leader's, for them
};

/// Throws ToleranceError when the tolerance is out of reach at the plan's rates, InputError when a journal to
/// resume is of another scan, plan, device or other options. A resumed build gives the volume and the
/// certificate of one that was never interrupted, to the bit. A plan that is moved here gives its memory
/// back.
VDVR_API BuildResult build(Device& device, const ProjectionSet& scan, Plan plan, const BuildOptions& options,
                           const Progress& progress = {});

/// Computes a share's blocks into `options.journal`, which a later build() takes as one of its `parts`: of
/// the same scan, plan and options. Blocks differ by what their bricks need alone, so that the parts together
/// are all that a build classifies. Throws what build() throws.
VDVR_API void build_share(Device& device, const ProjectionSet& scan, Plan plan, const BuildOptions& options,
                          const BuildShare& share, const Progress& progress = {});

}  // namespace vdvr
