// NumPy's arrays for vectors of ours, without a copy.
#pragma once

#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "vdvr/expert/grid.hpp"

namespace vdvr::python {

template <class T>
using NumpyArray = nanobind::ndarray<nanobind::numpy, T>;

/// Takes the vector over.
template <class T>
NumpyArray<T> as_array(std::vector<T>&& values, std::initializer_list<std::size_t> shape) {
  auto* const kept = new std::vector<T>(std::move(values));
  const nanobind::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return NumpyArray<T>(kept->data(), shape, owner);
}

/// Points x, y, z, one a row.
using PointArray =
    nanobind::ndarray<const double, nanobind::shape<-1, 3>, nanobind::c_contig, nanobind::device::cpu>;

inline std::span<const Vec3> points_of(const PointArray& points) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  return {reinterpret_cast<const Vec3*>(points.data()), points.shape(0)};
}

}  // namespace vdvr::python
