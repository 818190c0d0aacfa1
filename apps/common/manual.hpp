// Man pages (section 1) of a program and of each of its commands, from their option tables. Called for --man,
// which the build uses to make the pages that are installed.
#pragma once

#include <string>
#include <vector>

#include "apps/common/command.hpp"

namespace vdvr::cli {

/// The page of a program that has commands: what each is for.
std::string overview_page(const std::string& program, const std::string& purpose,
                          const std::vector<Command>& commands);
/// The page of one command, with those of its cases; of a program that does one thing, all of it.
std::string command_page(const Command& command);

}  // namespace vdvr::cli
