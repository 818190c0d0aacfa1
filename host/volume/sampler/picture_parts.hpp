// A picture of a volume that comes by bricks, in parts whose bricks fit the device.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <variant>
#include <vector>

#include "host/volume/sampler/paged_volume.hpp"
#include "shared/raycast_params.h"

namespace vdvr {

/// Pixels [x0, x1) x [y0, y1).
struct PixelBox {
  std::int64_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Beside the rays, what a part of a picture needs.
struct PartNeeds {
  bool lit = false;         ///< samples with their gradients
  bool beside = false;      ///< bricks that touch those of the rays, since gradients are taken
  std::uint64_t aside = 0;  ///< bytes that are to stay free of what is left
};

/// Cuts a picture in two, and each half again, until the bricks that the rays of a part may read fit. Every
/// side of a part but the picture's own is a multiple of a work-group's.
class PictureParts {
 public:
  /// Pixels along a side below which no part is cut: a work-group.
  static constexpr std::int64_t least_side = 8;
  using Draw = std::function<void(const PixelBox&, std::vector<std::uint8_t> here)>;

  /// `volume` must outlive it.
  PictureParts(const PagedVolume::Impl& volume, const std::variant<VdvrRaycast, VdvrSlice>& rays,
               const PartNeeds& needs);

  /// draw(pixels, by brick 1 where its samples may be read), part after part. Before the first of them it
  /// throws ResourceError where some pixels' bricks do not fit, saying what would do; between them
  /// Interrupted.
  void each(const PixelBox& picture, const Draw& draw) const;

 private:
  using Bricks = std::vector<std::uint32_t>;
  /// What some bricks and their neighbours take.
  struct Wanted {
    std::vector<std::uint8_t> here;
    std::uint64_t device_bytes = 0;
    bool fits = false;
  };
  struct Plan {
    std::vector<PixelBox> parts;
    std::uint64_t lacking = 0;  ///< bytes, of the smallest parts that do not fit
    std::uint64_t most = 0;     ///< that such a part takes
  };
  [[nodiscard]] Bricks met(const PixelBox& part, const Bricks& bricks) const;
  [[nodiscard]] glm::dvec3 position(std::uint32_t brick) const;
  [[nodiscard]] Wanted wanted(const Bricks& bricks) const;
  void cut(const PixelBox& part, const Bricks& around, Plan& plan) const;
  [[noreturn]] void refuse(const Plan& plan) const;

  const PagedVolume::Impl& volume_;
  std::variant<VdvrRaycast, VdvrSlice> rays_;
  PartNeeds needs_;
  glm::dvec3 wider_{0};  ///< cells, by which a brick is taken for larger
  Bricks all_;
  std::uint64_t limit_ = 0;  ///< of what is on the device for a part
};

}  // namespace vdvr
