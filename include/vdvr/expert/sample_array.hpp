// Samples in memory, or in a scratch file where they do not fit: the same to whoever reads them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/scratch.hpp"

namespace vdvr {

/// A contiguous array of float, std::uint16_t or std::uint8_t: std::span takes it. A copy lies where its
/// original does.
template <class T>
class VDVR_API Samples {
 public:
  using value_type = T;
  using const_iterator = const T*;

  Samples() = default;
  /// n zeros; in memory without `scratch`. Throws ResourceError naming `what`.
  Samples(std::size_t n, std::shared_ptr<Scratch> scratch, const std::string& what);
  Samples(std::vector<T> values);  // NOLINT(google-explicit-constructor): the same in memory
  /// Somebody else's, who keeps them as long as `owner` is held. A copy lies in memory of its own.
  Samples(std::span<T> values, std::shared_ptr<const void> owner)
      : owner_(std::move(owner)), data_(values.data()), size_(values.size()) {}
  Samples(std::initializer_list<T> values) : Samples(std::vector<T>(values)) {}
  Samples(const Samples& other);
  Samples(Samples&& other) noexcept;
  Samples& operator=(Samples other) noexcept;
  ~Samples();

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] T* begin() { return data_; }
  [[nodiscard]] T* end() { return data_ + size_; }
  [[nodiscard]] const T* begin() const { return data_; }
  [[nodiscard]] const T* end() const { return data_ + size_; }
  [[nodiscard]] T& operator[](std::size_t i) { return data_[i]; }
  [[nodiscard]] const T& operator[](std::size_t i) const { return data_[i]; }
  [[nodiscard]] const T& at(std::size_t i) const {
    if (i >= size_) throw std::out_of_range("Samples::at");
    return data_[i];
  }
  [[nodiscard]] T& front() { return data_[0]; }
  [[nodiscard]] const T& front() const { return data_[0]; }
  [[nodiscard]] T& back() { return data_[size_ - 1]; }
  [[nodiscard]] const T& back() const { return data_[size_ - 1]; }

  /// In memory from here on.
  void resize(std::size_t n);
  void assign(std::size_t n, T value) { *this = Samples(std::vector<T>(n, value)); }
  template <std::input_iterator Iterator>
  void assign(Iterator first, Iterator last) {
    *this = Samples(std::vector<T>(first, last));
  }
  void clear() { resize(0); }
  void push_back(T value) {
    resize(size_ + 1);
    back() = value;
  }
  void pop_back() { resize(size_ - 1); }

  /// Where it lies, for another as large; none in memory.
  [[nodiscard]] const std::shared_ptr<Scratch>& scratch() const { return scratch_; }
  /// Memory that it takes: all, or what its scratch files share.
  [[nodiscard]] std::uint64_t resident_bytes() const;

  friend bool operator==(const Samples& a, const Samples& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  void swap(Samples& other) noexcept;

  std::vector<T> memory_;
  std::shared_ptr<Scratch> scratch_;
  std::shared_ptr<const void> owner_;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// What a scan has.
using SampleArray = Samples<float>;

}  // namespace vdvr
