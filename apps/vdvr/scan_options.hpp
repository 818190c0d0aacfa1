// Options of commands that read scans: declared here and nowhere else, and what they say.
#pragma once

#include "apps/common/arguments.hpp"
#include "vdvr/expert/input_statement.hpp"

namespace vdvr::cli {

/// --angles-file, --beam, --follow-links, and what a user states of the input: --entry, --views, --darks,
/// --flats, --transmission, --line-integrals.
void add_scan(Arguments& args);

/// What options state; what they do not is as `stored`, a certificate's.
InputStatement input_statement(const Arguments& args, const InputStatement& stored = {});

/// The cameras of --picture-tolerance: --picture-views, in earlier versions --views with a file.
bool has_picture_views(const Arguments& args);
std::string picture_views(const Arguments& args);

}  // namespace vdvr::cli
