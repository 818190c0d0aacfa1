#include "apps/common/volume_json.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <string>
#include <nlohmann/json.hpp>

namespace vdvr::cli {
namespace {

Json storage_part(const Storage& s, std::uint64_t file_bytes) {
  return {{"samples_ratio", s.samples_ratio},
          {"bytes_ratio", s.bytes_ratio},
          {"device_bytes", s.device_bytes},
          {"file_bytes", file_bytes}};
}

}  // namespace

Json storage_json(const MixedVolume& volume, std::uint64_t file_bytes) {
  const Storage interior = storage_of(volume, true), whole = storage_of(volume, false);
  Json j = storage_part(whole, file_bytes);
  // The file does not hold the interior by itself: its bytes there are its share of those on the device.
  const double share = static_cast<double>(interior.device_bytes) / static_cast<double>(whole.device_bytes);
  j["interior"] = storage_part(interior, static_cast<std::uint64_t>(share * static_cast<double>(file_bytes)));
  return j;
}

Json levels_json(const MixedVolume& volume) {
  std::map<std::string, std::int64_t> counts;
  for (const auto& l : volume.level) ++counts[fmt::format("{}{}{}", l[0], l[1], l[2])];
  return counts;
}

}  // namespace vdvr::cli
