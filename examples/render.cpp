// A certified volume verified against its projections, a picture of it, and a picture of its error.
#include <iostream>

#include "vdvr/automatic_view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/verify_file.hpp"

namespace {

void draw(vdvr::Device& device, const vdvr::VdvrFile& file, const vdvr::ProjectionSet& scan,
          const std::string& folder) {
  const vdvr::RenderOptions view = vdvr::automatic_view(file.volume, file.certificate);
  const vdvr::ResidentVolume resident(device, file.volume);
  vdvr::write_png(folder + "/volume.png", vdvr::raycast(device, resident, view).image);

  vdvr::ErrorSliceOptions slice;
  slice.position = file.certificate.worst_at[2];
  const vdvr::ErrorSlice error = vdvr::error_slice(device, scan, file.volume, file.certificate, slice);
  vdvr::write_png(folder + "/error.png", error.image);
  std::cout << "largest |V - F| on the slice: " << error.max_error << ", certified "
            << file.certificate.epsilon_abs << '\n';
}

}  // namespace

int main(int count, char** words) try {
  if (count != 4) throw vdvr::InputError("usage: render FILE.vdvr SCAN FOLDER");
  const vdvr::VdvrFile file = vdvr::read_to_verify(words[1]);
  const vdvr::ProjectionSet scan = vdvr::read_scan(words[2]);
  vdvr::Device device;
  const vdvr::FileVerification verified = vdvr::verify_file(device, file, scan);
  if (!verified.holds) throw vdvr::MismatchError(verified.failure);
  draw(device, file, scan, words[3]);
} catch (const vdvr::Error& error) {
  std::cerr << "render: " << error.what() << '\n';
  return 1;
}
