// The list of angles beside a stack.
#include "tests/fuzz/target.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  std::ofstream(folder / "stack.mha")
      << "NDims = 3\nBinaryDataByteOrderMSB = False\nDimSize = 3 1 4\nElementType = MET_UCHAR\n"
         "ElementDataFile = LOCAL\nabcdefghijkl";
  return {"# degrees\n0 45\n90, 135\n", "0\n4.5e1\n-90\n+135.0 # the last\n",
          "\xef\xbb\xbf"
          "0.0\r\n45.0,\r\n90.0;\r\n135.0\r\n",
          "# \xb0\n0;1;2;3\n"};
}

void read(const std::filesystem::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  options.angles_file = file;
  options.input.values = SampleValues::line_integrals;
  static_cast<void>(read_scan(file.parent_path() / "stack.mha", options));
}

}  // namespace

const Target fuzz_target{"angles.txt", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
