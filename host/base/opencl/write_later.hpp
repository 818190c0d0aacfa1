// Small arrays that launches read, written without waiting for the device: a write that blocks waits for
// every kernel before it.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "host/base/opencl/array.hpp"

namespace vdvr::opencl {

/// Enqueues a write of a copy of `bytes`, which is freed when the device has read it. Throws DeviceError that
/// names `what`.
void enqueue_copy(State& state, const cl::Buffer& to, const void* bytes, std::size_t size,
                  const std::string& what);

/// Into the array's first elements; `values` may change at once. Meant for some megabytes at most.
template <class T>
void write_later(State& state, DeviceArray<T>& array, std::span<const T> values,
                 const std::string& what = "small arrays") {
  if (values.size() > array.size()) throw DeviceError(what + ": more values than the array holds");
  if (!values.empty()) enqueue_copy(state, array.buffer(), values.data(), values.size_bytes(), what);
}

/// An array of these values.
template <class T>
DeviceArray<T> copied(State& state, std::span<const T> values, const std::string& what) {
  DeviceArray<T> array(state, values.size(), what);
  write_later(state, array, values, what);
  return array;
}

}  // namespace vdvr::opencl
