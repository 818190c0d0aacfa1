// A picture of a certified volume, what is certain of each of its pixels, and that held to the scan.
#include <iostream>
#include <string>

#include "vdvr/automatic_view.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/verify_file.hpp"

int main(int count, char** words) try {
  if (count != 4) throw vdvr::InputError("usage: certify_picture FILE.vdvr SCAN PICTURE.png");
  const std::string picture_file = words[3];
  const vdvr::VdvrFile file = vdvr::read_certified(words[1]);
  const vdvr::ProjectionSet scan = vdvr::read_scan(words[2]);
  vdvr::Device device;

  vdvr::PictureRequest request;
  request.options = vdvr::automatic_view(file.volume, file.certificate);
  const vdvr::CertifiedPicture picture = vdvr::certify_picture(device, file, request);
  vdvr::write_certified_picture(picture_file, picture);
  std::cout << vdvr::bound_line(picture.bound, picture.epsilon, picture.bounds.light) << '\n';

  const auto certificate = vdvr::beside_picture(picture_file, request.options.mode).front();
  const vdvr::PictureVerification found = vdvr::verify_picture(device, file, certificate, {&scan, 16});
  if (!found.holds) throw vdvr::MismatchError(found.failures.front());
  std::cout << "F along " << found.rays->rays << " rays: never outside\n";
} catch (const vdvr::Error& error) {
  std::cerr << "certify_picture: " << error.what() << '\n';
  return 1;
}
