// What commands write: outputs refused up front, folders that fill file by file, JSON and text forms of our
// values.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/common/output_folder.hpp"
#include "apps/common/volume_json.hpp"
#include "apps/vdvr/options.hpp"
#include "apps/vdvr/understood.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::cli {

/// InputError unless `path` may be written: its folder exists, it is none of `inputs`, and it does not exist
/// or --force.
void check_output(const std::filesystem::path& path, bool force,
                  const std::vector<std::filesystem::path>& inputs);

Json grid_json(const Grid& grid);
Json geometry_json(const ParallelGeometry& geometry);
Json report_json(const InputReport& report);
Json bounds_json(const std::vector<Bound>& bounds);
Json budget_json(const ErrorBudget& budget);
Json certificate_json(const Certificate& certificate);
/// "certificate", or "comparison" where it is the record of one.
std::string record_name(const Certificate& certificate);
/// Along x, y, z.
std::array<int, 3> cells_per_base_sample(const LevelTriple& coarsening);
Json seconds_json(const std::map<std::string, double>& seconds);

std::string vec_text(const Vec3& v);
/// "2.4 GiB"
std::string bytes_text(std::uint64_t bytes);
void print_grid(const Grid& grid);
void print_bounds(const std::vector<Bound>& bounds, double epsilon_abs);
void print_budget(const ErrorBudget& budget, double epsilon_abs);
/// What a split of the views says of sigma.
std::string split_words(double ratio, bool resolved);
void print_certificate(const Certificate& certificate);
void print_storage(const MixedVolume& volume, std::uint64_t file_bytes);
void print_seconds(const std::map<std::string, double>& seconds);
void print_notes(const std::vector<std::string>& notes);

}  // namespace vdvr::cli
