// What was understood of a scan's files: for whoever reads one to show, before anything is made of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vdvr/expert/input_statement.hpp"

namespace vdvr {

/// One of the views as its file names it.
struct NamedView {
  std::int64_t view = 0;        ///< of the scan
  std::int64_t projection = 0;  ///< of the file, where views were left out
  std::string name;             ///< the file, or the dataset and the number
};

/// What no file and no option says, what was taken instead, and how to say otherwise.
struct Assumption {
  std::string what, why, otherwise;
};

struct Understood {
  InputStatement stated;  ///< by options; views as they are counted
  SampleValues values = SampleValues::line_integrals;
  std::string values_source;          ///< who says so
  std::int64_t flats = 0, darks = 0;  ///< frames that were averaged; 0 where a level stands for them
  std::vector<NamedView> frames;      ///< the first, the second and the last view
  std::vector<Assumption> assumed;
  std::vector<std::string> warnings;  ///< what makes F doubtful; a line each, among the report's notes too
};

}  // namespace vdvr
