// The table of commands, in command_table.cpp. main.cpp looks a command up, and hands it its arguments; each
// command lives in the file of its name.
#pragma once

#include <vector>

#include "apps/common/command.hpp"

namespace vdvr::cli {

const std::vector<Command>& commands();

int devices_command(Arguments& args);
int simulate_command(Arguments& args);
int info_command(Arguments& args);
int center_command(Arguments& args);
int reconstruct_command(Arguments& args);
int plan_command(Arguments& args);
int build_command(Arguments& args);
int verify_command(Arguments& args);
int probe_command(Arguments& args);
int residual_command(Arguments& args);
int measure_command(Arguments& args);
int audit_command(Arguments& args);
int render_command(Arguments& args);
int export_command(Arguments& args);
int convert_geometry_command(Arguments& args);
int run_command(Arguments& args);
int serve_command(Arguments& args);
int bench_command(Arguments& args);

}  // namespace vdvr::cli
