// Nikon's .xtekct files, over the stack of cone_folder.hpp.
#include "tests/fuzz/cone_folder.hpp"

namespace vdvr::fuzz {
namespace {

std::vector<std::string> seeds(const std::filesystem::path& folder) {
  write_cone_folder(folder, "nikon", "scan.xtekct");
  const std::string start =
      "[XTekCT]\r\nName=view\r\nInputFolderName=\r\nSrcToObject=50\r\nSrcToDetector=100.5\r\n"
      "DetectorPixelsX=3\r\nDetectorPixelsY=2\r\nDetectorPixelSizeX=0.5\r\nDetectorPixelSizeY=0.25\r\n"
      "Projections=4\r\nInitialAngle=-10.25\r\nAngularStep=90\r\nWhiteLevel=60000\r\n";
  return {start, start +
                     "CentreOfRotationTop=0.25\r\nCentreOfRotationBottom=-0.125\r\nObjectTilt=1\r\n"
                     "DetectorOffsetX=0.5\r\n[Xrays]\r\nXraykV=120\r\n"};
}

}  // namespace

const Target fuzz_target{"scan.xtekct", Contents::text, seeds, read_cone_folder};

}  // namespace vdvr::fuzz
