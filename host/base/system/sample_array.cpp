#include "vdvr/expert/sample_array.hpp"

#include <algorithm>
#include <utility>

namespace vdvr {

template <class T>
Samples<T>::Samples(std::size_t n, std::shared_ptr<Scratch> scratch, const std::string& what)
    : scratch_(std::move(scratch)), size_(n) {
  if (scratch_) {
    data_ = scratch_->map<T>(n, what).data();
    return;
  }
  memory_.resize(n);
  data_ = memory_.data();
}

template <class T>
Samples<T>::Samples(std::vector<T> values)
    : memory_(std::move(values)), data_(memory_.data()), size_(memory_.size()) {}

template <class T>
Samples<T>::Samples(const Samples& other) : Samples(other.size_, other.scratch_, "a copy") {
  std::copy(other.begin(), other.end(), begin());
}

template <class T>
Samples<T>::Samples(Samples&& other) noexcept {
  swap(other);
}

template <class T>
Samples<T>& Samples<T>::operator=(Samples other) noexcept {
  swap(other);
  return *this;
}

template <class T>
Samples<T>::~Samples() {
  if (scratch_) scratch_->unmap(data_);
}

template <class T>
void Samples<T>::swap(Samples& other) noexcept {
  memory_.swap(other.memory_);  // keeps the places of both
  scratch_.swap(other.scratch_);
  owner_.swap(other.owner_);
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
}

template <class T>
void Samples<T>::resize(std::size_t n) {
  if (scratch_ || owner_) {
    *this = Samples(std::vector<T>(begin(), begin() + std::min(n, size_)));
  }
  memory_.resize(n);
  data_ = memory_.data();
  size_ = n;
}

template <class T>
std::uint64_t Samples<T>::resident_bytes() const {
  const std::uint64_t all = sizeof(T) * static_cast<std::uint64_t>(size_);
  return scratch_ ? std::min(all, scratch_->resident_bytes()) : all;
}

template class Samples<float>;
template class Samples<std::uint16_t>;
template class Samples<std::uint8_t>;

}  // namespace vdvr
