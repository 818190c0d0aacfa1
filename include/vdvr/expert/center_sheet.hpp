// A contact sheet of one row reconstructed at several centres, with a figure of merit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

struct CenterSheetOptions {
  FieldOptions field;                 ///< `center` is not looked at
  std::vector<double> centers;        ///< columns of the projections as they are prepared, rising, at least 3
  std::vector<std::string> captions;  ///< one each
  std::int64_t row = 0;               ///< of the projections as they are prepared
  std::size_t marked = 0;             ///< the slice that gets a frame
  std::string title;
};

struct CenterSheet {
  Image image;
  /// By centre; the least is the best. Of half a turn the integral of the magnitude over that of a view
  /// (Donath et al., Journal of the Optical Society of America A 23, 2006, 1048, their metric of absolute
  /// values): a wrong centre throws streaks to both sides of 0. Of a full turn the mean magnitude over the
  /// root mean square: there a wrong centre blurs. Of a half acquisition, whose slices may be cut, the
  /// squares of what opposite views differ by where both see, over their own.
  std::vector<double> merit;
  std::optional<std::size_t> best;  ///< of merit, where it has a least one that is not the first or the last
  bool sharpness = false;           ///< the merit is that of a full turn
  bool joined = false;  ///< half acquisition: opposite views were joined to views of a wider detector
};

/// Slices at the row's height by FBP or FDK without upsampling, up to 360 samples wide, in five columns,
/// under one window; below them the merit by centre. Of a half acquisition opposite views are joined first,
/// which `reconstruct` does not do. Cost: a row (of cone beam: the rows that the slice meets) filtered and
/// back-projected to 130,000 samples once a centre. Throws InputError for a row or a centre off the detector.
VDVR_API CenterSheet center_sheet(Device& device, const ProjectionSet& scan,
                                  const CenterSheetOptions& options, const Progress& progress = {});

}  // namespace vdvr
