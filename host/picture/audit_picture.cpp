#include "vdvr/expert/audit_picture.hpp"

#include <algorithm>

#include "vdvr/expert/error_slice.hpp"

namespace vdvr {

Image audit_picture(Device& device, const ProjectionSet& scan, const Volume& volume, const Audit& audit,
                    const AuditOptions& options, const Progress& progress) {
  constexpr std::int64_t side = 900;
  const AuditFigures& f = audit.as_is;
  Certificate like;  // what an error slice asks of one
  like.field = options.field;
  like.roi = options.roi;
  like.epsilon_abs = f.within.value_or(f.lower > 0 ? f.lower : 1);
  ErrorSliceOptions slice;
  slice.position =
      std::clamp(f.lower_at[2], volume.grid.origin[2], volume.grid.position(volume.grid.cells)[2]);
  slice.width = slice.height = side;
  slice.volume = "W";
  slice.end = f.within ? "the tolerance" : "the largest found";
  return error_slice(device, scan, as_mixed(volume), like, slice, progress).image;
}

}  // namespace vdvr
