// A JSON object with typed access, such as scan.json or a member of it. Every complaint names file, member
// and value.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/expert/grid.hpp"

namespace vdvr::io {

class Description {
 public:
  /// Throws FileError: missing, larger than 16 MiB, not a JSON object, a member that is not among `known`.
  Description(std::filesystem::path file, const std::set<std::string>& known);
  /// The object that is member `key`.
  [[nodiscard]] Description member(const std::string& key, const std::set<std::string>& known) const;

  /// The objects that the list `key` holds, at least one and no more than `most`.
  [[nodiscard]] std::vector<Description> members(const std::string& key, const std::set<std::string>& known,
                                                 std::size_t most = 100'000) const;

  [[noreturn]] void fail(const std::string& what) const;
  [[nodiscard]] bool has(const std::string& key) const { return json_.contains(key); }
  /// 'key', with the members that it lies in: 'geometry.pitch'.
  [[nodiscard]] std::string quoted(const std::string& key) const;
  [[nodiscard]] std::filesystem::path folder() const { return file_.parent_path(); }

  [[nodiscard]] bool is_number(const std::string& key) const { return json_.at(key).is_number(); }
  [[nodiscard]] bool is_text(const std::string& key, const std::string& text) const {
    return json_.at(key).is_string() && json_.at(key).get<std::string>() == text;
  }
  [[nodiscard]] bool is_list(const std::string& key) const { return json_.at(key).is_array(); }
  /// A list whose first entry is one.
  [[nodiscard]] bool is_table(const std::string& key) const {
    return is_list(key) && !json_.at(key).empty() && json_.at(key)[0].is_array();
  }
  [[nodiscard]] std::string text(const std::string& key) const;
  [[nodiscard]] bool flag(const std::string& key) const;
  [[nodiscard]] double number(const std::string& key) const;
  [[nodiscard]] double number_or(const std::string& key, double fallback) const;
  [[nodiscard]] double positive(const std::string& key) const;
  [[nodiscard]] std::int64_t integer(const std::string& key) const;
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
  [[nodiscard]] std::vector<double> numbers(const std::string& key) const;
  [[nodiscard]] Vec3 vec3(const std::string& key) const;
  /// One number, which stands for both, or [u, v].
  [[nodiscard]] std::pair<double, double> pair(const std::string& key) const;
  /// A list of lists of `width` numbers, one after the other.
  [[nodiscard]] std::vector<double> table(const std::string& key, std::size_t width) const;
  /// A half-open range within 0 .. count.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> half_open(const std::string& key, std::int64_t count,
                                                                const char* what) const;
  [[nodiscard]] std::vector<std::pair<std::int64_t, std::int64_t>> ranges(const std::string& key) const;
  /// The same, or one range by itself.
  [[nodiscard]] std::vector<std::pair<std::int64_t, std::int64_t>> one_or_more_ranges(
      const std::string& key) const;

  /// A file of the folder; names out of it are refused.
  [[nodiscard]] std::filesystem::path inside(const std::string& name, const std::string& key) const;
  /// Names relative to the folder; * ? [] in the last part, in natural order.
  [[nodiscard]] std::vector<std::string> matches(const std::string& key) const;
  [[nodiscard]] std::vector<std::string> matches(const std::string& pattern, const std::string& key) const;

 private:
  Description(std::filesystem::path file, std::string within, nlohmann::json json,
              const std::set<std::string>& known);
  void require_known(const std::set<std::string>& known) const;

  std::filesystem::path file_;
  std::string within_;  ///< "geometry." for a member's object
  nlohmann::json json_;
};

}  // namespace vdvr::io
