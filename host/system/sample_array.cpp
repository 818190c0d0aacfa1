#include "vdvr/sample_array.hpp"

#include <algorithm>
#include <utility>

namespace vdvr {

SampleArray::SampleArray(std::size_t n, std::shared_ptr<Scratch> scratch, const std::string& what)
    : scratch_(std::move(scratch)), size_(n) {
  if (scratch_) {
    data_ = scratch_->map(n, what).data();
    return;
  }
  memory_.resize(n);
  data_ = memory_.data();
}

SampleArray::SampleArray(std::vector<float> values)
    : memory_(std::move(values)), data_(memory_.data()), size_(memory_.size()) {}

SampleArray::SampleArray(const SampleArray& other) : SampleArray(other.size_, other.scratch_, "a copy") {
  std::copy(other.begin(), other.end(), begin());
}

SampleArray::SampleArray(SampleArray&& other) noexcept { swap(other); }

SampleArray& SampleArray::operator=(SampleArray other) noexcept {
  swap(other);
  return *this;
}

SampleArray::~SampleArray() {
  if (scratch_) scratch_->unmap({data_, size_});
}

void SampleArray::swap(SampleArray& other) noexcept {
  memory_.swap(other.memory_);  // keeps the places of both
  scratch_.swap(other.scratch_);
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
}

void SampleArray::resize(std::size_t n) {
  if (scratch_) {
    *this = SampleArray(std::vector<float>(begin(), begin() + std::min(n, size_)));
  }
  memory_.resize(n);
  data_ = memory_.data();
  size_ = n;
}

std::uint64_t SampleArray::resident_bytes() const {
  const std::uint64_t all = sizeof(float) * static_cast<std::uint64_t>(size_);
  return scratch_ ? std::min(all, scratch_->resident_bytes()) : all;
}

}  // namespace vdvr
