// RTK's XML files of geometry.
#include "tests/fuzz/cone_folder.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_cone_folder(folder, "rtk_geometry", "geometry.xml");
  const std::string start =
      "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n";
  std::string once = start +
                     "<SourceToIsocenterDistance>100</SourceToIsocenterDistance>\n"
                     "<SourceToDetectorDistance>150</SourceToDetectorDistance>\n";
  std::string each = start;
  for (const char* angle : {"0", "90", "180", "270"}) {
    const std::string gantry = std::string("<GantryAngle>") + angle + "</GantryAngle>";
    once += "  <Projection>" + gantry + "</Projection>\n";
    each +=
        "  <Projection>" + gantry +
        "<SourceToIsocenterDistance>100</SourceToIsocenterDistance>"
        "<SourceToDetectorDistance>150</SourceToDetectorDistance><InPlaneAngle>359.5</InPlaneAngle>"
        "<ProjectionOffsetX>0.25</ProjectionOffsetX><!-- &amp; -->" +
        (angle[0] == '0' ? "<Matrix>\n-149.994288451 1.30898025 -0.25 25\n-1.30898025 -149.994288451 0 0\n0 "
                           "0 1 -100\n</Matrix>"
                         : "") +
        "</Projection>\n";
  }
  return {once + "</RTKThreeDCircularGeometry>\n", each + "</RTKThreeDCircularGeometry>"};
}

}  // namespace

const Target fuzz_target{"geometry.xml", Contents::text, seeds, read_cone_folder};

}  // namespace vdvr::fuzz
