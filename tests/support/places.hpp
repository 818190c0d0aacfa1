// Where this build's files lie. Not as macros of the command line: with those no compiler cache would know a
// test again in another folder.
#pragma once

namespace vdvr::support {

extern const char* const source_dir;   // the repository
extern const char* const vdvr_binary;  // the program

}  // namespace vdvr::support
