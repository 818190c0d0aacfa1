// Option groups shared by several commands: declared by add_*, read by the function of the group's name.
#pragma once

#include <optional>

#include "apps/common/common_options.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/plan.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::cli {

void add_field(Arguments& args);
void add_grid(Arguments& args);
void add_rates(Arguments& args);
void add_tolerance(Arguments& args);
void add_build(Arguments& args);

FieldOptions field_options(const Arguments& args);
bool has_field_options(const Arguments& args);
bool has_preparation_options(const Arguments& args);
/// `size`: the option that holds the cells, where --size is something else.
GridOptions grid_options(const Arguments& args, const std::string& size = "size");
RateOptions rate_options(const Arguments& args);
/// --upsampling alone: a power of two up to 64, default 1.
int upsampling_option(const Arguments& args);
/// 0.03 or 3%, above 0 and at most 1.
double fraction_option(const Arguments& args, const std::string& name);
/// --epsilon 1sigma, .5sigma: the number; nothing of any other tolerance.
std::optional<double> sigmas_option(const Arguments& args);
/// Exactly one of --epsilon and --epsilon-abs.
Tolerance tolerance(const Arguments& args);
/// Includes --roi of the grid group.
BuildOptions build_options(const Arguments& args);
/// How the .vdvr file is written, for the commands that write one.
void add_compression(Arguments& args);
Compression compression(const Arguments& args);
/// Of the build group, what a plan must know.
PlanSettings plan_settings(const Arguments& args);

/// InputError when one of `names` was given: `reason` says why the command does not take it.
void refuse(const Arguments& args, const std::vector<std::string>& names, const std::string& reason);

}  // namespace vdvr::cli
