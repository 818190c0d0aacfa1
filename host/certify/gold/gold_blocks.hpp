// Which boxes of bricks are computed together.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Bricks first .. first + size - 1, x, y, z.
struct BrickBox {
  Index3 first{}, size{};
};

/// Boxes that hold every brick with selected[(z * bricks[1] + y) * bricks[0] + x] != 0 once: the cells of a
/// lattice of `block` bricks (cut to the grid), each whole, or halved along every axis, again and again,
/// where boxes that hold no selected brick then save more than the others' halos cost. `cost`: of a box of a
/// size. By layer z, then by size, then by place.
std::vector<BrickBox> cover_bricks(const Index3& bricks, const std::vector<std::uint8_t>& selected,
                                   const Index3& block, const std::function<double(const Index3&)>& cost);

}  // namespace vdvr
