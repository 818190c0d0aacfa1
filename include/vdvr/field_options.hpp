// What F is, of all the fields that a scan could stand for (docs/geometry.md).
#pragma once

#include <optional>
#include <string>

namespace vdvr {

/// The field options that define F (docs/geometry.md); stored in the certificate, taken from it by `verify`.
struct FieldOptions {
  std::string filter = "ram-lak";  ///< ram-lak | shepp-logan | cosine | hamming | hann
  double cutoff = 1.0;             ///< fraction of the detector's Nyquist frequency
  std::optional<double> center;    ///< overrides the scan's
};

}  // namespace vdvr
