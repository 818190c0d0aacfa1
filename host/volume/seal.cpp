// Bytes of the seal: every variable part comes after its length, so that no two files give the same bytes.
#include "host/volume/seal.hpp"

#include <algorithm>
#include <cstdint>
#include <tuple>

#include "vdvr/expert/hash.hpp"

namespace vdvr {
namespace {

// Says what is hashed, and in which version of this definition.
constexpr std::string_view heading = "vdvr seal 1\n";

class Stream {
 public:
  void bytes(std::string_view text) { hash_.update(text.data(), text.size()); }
  void count(std::uint64_t n) {
    const auto value = static_cast<std::int64_t>(n);
    hash_.update(&value, sizeof value);
  }
  void text(std::string_view text) {
    count(text.size());
    bytes(text);
  }
  std::string hex() { return hash_.hex(); }
  void totals(std::span<const float> values) {
    count(values.size());
    hash_.update(values.data(), values.size_bytes());
  }

 private:
  Sha256 hash_;
};

}  // namespace

std::string seal_of(const std::string& certificate, std::span<const float> brick_totals,
                    std::vector<io::hdf5::Attribute> attributes) {
  std::sort(attributes.begin(), attributes.end(), [](const auto& a, const auto& b) {
    return std::tie(a.object, a.name) < std::tie(b.object, b.name);
  });
  Stream out;
  out.bytes(heading);
  out.text(certificate);
  out.totals(brick_totals);
  for (const auto& a : attributes) {
    if (a.object == "/" && a.name == kSeal) continue;
    out.text(a.object);
    out.text(a.name);
    out.bytes(std::string_view(&a.kind, 1));
    out.count(a.count);
    out.bytes(a.bytes);
  }
  return out.hex();
}

}  // namespace vdvr
