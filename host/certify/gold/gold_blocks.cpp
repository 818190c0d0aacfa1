#include "host/certify/gold/gold_blocks.hpp"

#include <algorithm>
#include <tuple>

namespace vdvr {
namespace {

class Cover {
 public:
  Cover(const Index3& bricks, const std::vector<std::uint8_t>& selected,
        const std::function<double(const Index3&)>& cost)
      : bricks_(bricks), selected_(selected), cost_(cost) {}

  // Appends the cheapest boxes for what is selected in `box`, and returns their cost.
  double operator()(const BrickBox& box, std::vector<BrickBox>& out) const {
    if (!any(box)) return 0;
    const double whole = cost_(box.size);
    if (box.size == Index3{1, 1, 1}) {
      out.push_back(box);
      return whole;
    }
    std::vector<BrickBox> parts;
    double sum = 0;
    for (int corner = 0; corner < 8 && sum < whole; ++corner) {
      BrickBox part;
      for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t half = (box.size[a] + 1) / 2;
        const bool high = corner >> a & 1;
        part.first[a] = box.first[a] + (high ? half : 0);
        part.size[a] = high ? box.size[a] - half : half;
      }
      if (*std::min_element(part.size.begin(), part.size.end()) > 0) sum += (*this)(part, parts);
    }
    if (sum >= whole) {
      out.push_back(box);
      return whole;
    }
    out.insert(out.end(), parts.begin(), parts.end());
    return sum;
  }

 private:
  bool any(const BrickBox& box) const {
    for (std::int64_t z = box.first[2]; z < box.first[2] + box.size[2]; ++z)
      for (std::int64_t y = box.first[1]; y < box.first[1] + box.size[1]; ++y) {
        const auto row = selected_.begin() + (z * bricks_[1] + y) * bricks_[0] + box.first[0];
        if (std::any_of(row, row + box.size[0], [](std::uint8_t s) { return s != 0; })) return true;
      }
    return false;
  }

  const Index3& bricks_;
  const std::vector<std::uint8_t>& selected_;
  const std::function<double(const Index3&)>& cost_;
};

}  // namespace

std::vector<BrickBox> cover_bricks(const Index3& bricks, const std::vector<std::uint8_t>& selected,
                                   const Index3& block, const std::function<double(const Index3&)>& cost) {
  const Cover cover(bricks, selected, cost);
  std::vector<BrickBox> out;
  for (std::int64_t z = 0; z < bricks[2]; z += block[2])
    for (std::int64_t y = 0; y < bricks[1]; y += block[1])
      for (std::int64_t x = 0; x < bricks[0]; x += block[0])
        cover({{x, y, z},
               {std::min(block[0], bricks[0] - x), std::min(block[1], bricks[1] - y),
                std::min(block[2], bricks[2] - z)}},
              out);
  const auto key = [](const BrickBox& b) {
    return std::tuple(b.first[2], b.size[2], b.size[0], b.size[1], b.first[1], b.first[0]);
  };
  std::sort(out.begin(), out.end(), [&](const BrickBox& a, const BrickBox& b) { return key(a) < key(b); });
  return out;
}

}  // namespace vdvr
