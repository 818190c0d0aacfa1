// MetaImage, plain and compressed.
#include "tests/fuzz/raster_fuzz.hpp"
#include "tests/fuzz/target.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_angles(folder);
  const std::string geometry =
      "DistanceUnits = mm\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 -1 2.5\nElementSpacing = 0.5 2 1\n"
      "DimSize = 4 2 3\n";
  const std::string start = "ObjectType = Image\nNDims = 3\nBinaryData = True\n";
  std::string floats(96, '\0');
  for (std::size_t i = 3; i < floats.size(); i += 4) floats[i] = '?';
  return {start + "BinaryDataByteOrderMSB = False\n" + geometry +
              "ElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefghijklmnopqrstuvwx",
          start + "BinaryDataByteOrderMSB = False\nCompressedData = True\n" + geometry +
              "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n" + deflated(floats),
          start + "BinaryDataByteOrderMSB = True\n" + geometry +
              "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n" + std::string(96, '\1')};
}

void read(const std::filesystem::path& file) { read_raster(file, memory_limit); }

}  // namespace

const Target fuzz_target{"volume.mha", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
