// The table of commands. main.cpp looks a command up, hands it its arguments and turns exceptions into exit
// codes; each command lives in the file of its name.
#pragma once

#include <vector>

namespace vdvr::cli {

class Arguments;

struct Command {
  const char* name;
  const char* usage;    ///< what follows the name on the usage line
  const char* purpose;  ///< one line
  int (*run)(Arguments& args);
};

const std::vector<Command>& commands();

int devices_command(Arguments& args);
int simulate_command(Arguments& args);
int info_command(Arguments& args);
int reconstruct_command(Arguments& args);
int plan_command(Arguments& args);
int build_command(Arguments& args);
int verify_command(Arguments& args);
int probe_command(Arguments& args);
int render_command(Arguments& args);
int export_command(Arguments& args);
int run_command(Arguments& args);
int bench_command(Arguments& args);

}  // namespace vdvr::cli
