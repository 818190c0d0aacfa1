#include "host/verify/audit/orientation.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"

namespace vdvr {
namespace {

constexpr std::array<const char*, 3> kNames{"x", "y", "z"};

std::size_t axis(const Orientation& o, std::size_t a) { return at(o.axes[a]); }

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

int moved_axes(const Orientation& o) {
  int moved = 0;
  for (int a = 0; a < 3; ++a) moved += o.axes[at(a)] != a;
  return moved;
}

}  // namespace

int Orientation::changes() const {
  return 2 * moved_axes(*this) + static_cast<int>(std::count(mirrored.begin(), mirrored.end(), true));
}

bool Orientation::is_turn() const {
  const int moved = moved_axes(*this);
  const bool even = moved != 2;  // two axes exchanged are one mirror
  return even == (std::count(mirrored.begin(), mirrored.end(), true) % 2 == 0);
}

const std::vector<Orientation>& orientations() {
  static const std::vector<Orientation> all = [] {
    std::vector<Orientation> list;
    std::array<int, 3> axes{0, 1, 2};
    do {
      for (int m = 0; m < 8; ++m) list.push_back({axes, {(m & 1) != 0, (m & 2) != 0, (m & 4) != 0}});
    } while (std::next_permutation(axes.begin(), axes.end()));
    std::stable_sort(list.begin(), list.end(),
                     [](const Orientation& a, const Orientation& b) { return a.changes() < b.changes(); });
    return list;
  }();
  return all;
}

Grid oriented(const Grid& grid, const Orientation& o) {
  Grid to = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t from = axis(o, a);
    to.cells[a] = grid.cells[from];
    to.spacing[a] = grid.spacing[from];
    to.origin[a] = grid.origin[from];
  }
  return to;
}

Index3 source_of(const Index3& sample, const Grid& grid, const Orientation& o) {
  Index3 from{};
  for (std::size_t a = 0; a < 3; ++a)
    from[axis(o, a)] = o.mirrored[a] ? grid.cells[axis(o, a)] - sample[a] : sample[a];
  return from;
}

Volume oriented(const Volume& volume, const Orientation& o) {
  Volume to{oriented(volume.grid, o), std::vector<float>(volume.samples.size())};
  const Index3 n = volume.grid.samples(), m = to.grid.samples();
  parallel_for(m[2], {}, "", [&](std::int64_t z) {
    for (std::int64_t y = 0; y < m[1]; ++y)
      for (std::int64_t x = 0; x < m[0]; ++x) {
        const Index3 s = source_of({x, y, z}, volume.grid, o);
        to.samples[at((z * m[1] + y) * m[0] + x)] = volume.samples[at((s[2] * n[1] + s[1]) * n[0] + s[0])];
      }
  });
  return to;
}

std::string words_of(const Orientation& o) {
  std::vector<std::string> mirrored, plain;
  for (std::size_t a = 0; a < 3; ++a) (o.mirrored[a] ? mirrored : plain).emplace_back(kNames[a]);
  const int moved = moved_axes(o);
  if (moved == 0) {
    if (mirrored.empty()) return "";
    if (mirrored.size() == 2)
      return fmt::format("mirrored along {}, which is half a turn about {}", listed(mirrored), plain.front());
    return fmt::format("mirrored along {}", listed(mirrored));
  }
  std::string text;
  if (moved == 2) {
    std::vector<std::string> swapped;
    std::string kept;
    for (std::size_t a = 0; a < 3; ++a)
      if (axis(o, a) != a) swapped.emplace_back(kNames[a]);
      else kept = kNames[a];
    text = fmt::format("axes {} transposed", listed(swapped));
    if (!mirrored.empty()) text += fmt::format(" and mirrored along {}", listed(mirrored));
    const bool quarter = o.is_turn() && mirrored.size() == 1 && mirrored.front() != kept;
    return quarter ? text + fmt::format(", which is a quarter turn about {}", kept) : text;
  }
  text = fmt::format("axes in another order: x, y, z are the file's {}, {}, {}", kNames[axis(o, 0)],
                     kNames[axis(o, 1)], kNames[axis(o, 2)]);
  return mirrored.empty() ? text : text + fmt::format(", and mirrored along {}", listed(mirrored));
}

}  // namespace vdvr
