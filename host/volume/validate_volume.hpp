// What a volume in a .vdvr file must satisfy (docs/file-format.md): one set of checks for the reader, who
// makes a FileError of a problem, and for the writer, who makes an InputError.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

inline constexpr int largest_shift = 24;
inline constexpr int largest_level = 6;  ///< of any axis: a record has three bits for it
inline constexpr std::int64_t code_limit = std::int64_t{1} << 24;  ///< integers below are exact in fp32

/// What is wrong with a volume, and where.
struct Problem {
  std::string where, what;
};

/// "021", and where tiles of that triple and type lie: "/tiles/021", "/tiles/021_1".
std::string name_of(const LevelTriple& level);
std::string path_of(const TileKind& kind);

/// No axis is finer than gold.
bool is_within_rate(const MixedVolume& volume, const LevelTriple& level);

std::optional<Problem> grid_problem(const MixedVolume& volume);
/// Levels within the rate, and every tile of every triple used by exactly one brick; `counts` has the tiles.
std::optional<Problem> index_problem(const MixedVolume& volume,
                                     const std::map<TileKind, std::uint64_t>& counts);
/// The parts of a triple follow one another, and no two have the same type.
std::optional<Problem> parts_problem(const std::map<TileKind, SampleType>& types);
/// Of the samples of a block whose vectors have the right sizes.
std::optional<Problem> block_problem(const std::string& where, const SampleBlock& block);
std::optional<Problem> step_problem(const MixedVolume& volume);
/// Everything the reader would refuse, so that the writer never writes it.
std::optional<Problem> validate_volume(const MixedVolume& volume);

bool has_integers(const MixedVolume& volume);
/// Whether tiles of one triple have several types.
bool has_parts(const MixedVolume& volume);

}  // namespace vdvr
