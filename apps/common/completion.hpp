// Completion of a program's command line, from the option tables of its commands. Called for --completion.
#pragma once

#include <string>
#include <vector>

#include "apps/common/command.hpp"

namespace vdvr::cli {

/// A script for bash: commands, their cases and options, the choices of an option, files and folders. It
/// needs nothing but bash. A program that does one thing has one command of no name.
std::string bash_completion(const std::string& program, const std::vector<Command>& commands);

}  // namespace vdvr::cli
