// Projections and a tolerance in, a certified volume out.
#include <iostream>
#include <string>

#include "vdvr/certify_scan.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/vdvr_file.hpp"

int main(int count, char** words) try {
  if (count != 4) throw vdvr::InputError("usage: certify SCAN FRACTION OUT.vdvr");
  const vdvr::ProjectionSet scan = vdvr::read_scan(words[1]);
  const auto noise = vdvr::read_scan_noise(words[1], {}, scan);  // told beside the bounds, where it is known
  vdvr::Device device;
  const vdvr::Tolerance tolerance{.relative = std::stod(words[2]), .absolute = {}};
  const auto made = vdvr::certify_scan(device, scan, {tolerance, {}}, noise);
  vdvr::write_vdvr(words[3], made.volume, made.certificate);
  std::cout << "|V - F| <= " << made.certificate.epsilon_abs << " at every covered point\n";
} catch (const vdvr::Error& error) {
  std::cerr << "certify: " << error.what() << '\n';
  return 1;
}
