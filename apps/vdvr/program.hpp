// vdvr, the command line: finds the command in the table and runs it. Called by main.cpp, and by the Python
// module, whose wheel has the program in it.
#pragma once

#include <string>
#include <vector>

namespace vdvr::cli {

/// `words`: those after the program's name. Gives the exit code.
int run_program(const std::vector<std::string>& words);

}  // namespace vdvr::cli
