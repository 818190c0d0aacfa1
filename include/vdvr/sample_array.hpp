// Samples in memory, or in a scratch file where they do not fit: the same to whoever reads them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "vdvr/export.hpp"
#include "vdvr/scratch.hpp"

namespace vdvr {

/// A contiguous array of float: std::span takes it. A copy lies where its original does.
class VDVR_API SampleArray {
 public:
  SampleArray() = default;
  /// n zeros; in memory without `scratch`. Throws ResourceError naming `what`.
  SampleArray(std::size_t n, std::shared_ptr<Scratch> scratch, const std::string& what);
  SampleArray(std::vector<float> values);  // NOLINT(google-explicit-constructor): the same in memory
  SampleArray(std::initializer_list<float> values) : SampleArray(std::vector<float>(values)) {}
  SampleArray(const SampleArray& other);
  SampleArray(SampleArray&& other) noexcept;
  SampleArray& operator=(SampleArray other) noexcept;
  ~SampleArray();

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] float* data() { return data_; }
  [[nodiscard]] const float* data() const { return data_; }
  [[nodiscard]] float* begin() { return data_; }
  [[nodiscard]] float* end() { return data_ + size_; }
  [[nodiscard]] const float* begin() const { return data_; }
  [[nodiscard]] const float* end() const { return data_ + size_; }
  [[nodiscard]] float& operator[](std::size_t i) { return data_[i]; }
  [[nodiscard]] const float& operator[](std::size_t i) const { return data_[i]; }
  [[nodiscard]] float& front() { return data_[0]; }
  [[nodiscard]] float& back() { return data_[size_ - 1]; }

  /// In memory from here on.
  void resize(std::size_t n);
  void assign(std::size_t n, float value) { *this = SampleArray(std::vector<float>(n, value)); }
  template <class Iterator>
  void assign(Iterator first, Iterator last) {
    *this = SampleArray(std::vector<float>(first, last));
  }
  void push_back(float value) {
    resize(size_ + 1);
    back() = value;
  }

  /// Where it lies, for another as large; none in memory.
  [[nodiscard]] const std::shared_ptr<Scratch>& scratch() const { return scratch_; }
  /// Memory that it takes: all, or what its scratch files share.
  [[nodiscard]] std::uint64_t resident_bytes() const;

 private:
  void swap(SampleArray& other) noexcept;

  std::vector<float> memory_;
  std::shared_ptr<Scratch> scratch_;
  float* data_ = nullptr;
  std::size_t size_ = 0;
};

inline bool operator==(const SampleArray& a, const SampleArray& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!(a[i] == b[i])) return false;
  return true;
}

}  // namespace vdvr
