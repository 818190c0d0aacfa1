// See hdf5_links.hpp.
#include "host/files/hdf5/hdf5_links.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <utility>

#include "vdvr/error.hpp"

namespace vdvr::io::hdf5 {
namespace {

namespace fs = std::filesystem;

/// On one path: more are a circle.
constexpr int most_links = 64;
constexpr std::size_t longest_link = 1 << 16;

std::deque<std::string> steps_of(const std::string& path) {
  std::deque<std::string> steps;
  for (std::size_t at = 0; at < path.size();) {
    const std::size_t end = std::min(path.find('/', at), path.size());
    const std::string step = path.substr(at, end - at);
    if (!step.empty() && step != ".") steps.push_back(step);
    at = end + 1;
  }
  return steps;
}

Handle root_of(const LinkedFile& file) { return {H5Oopen(file.id.id(), "/", H5P_DEFAULT), H5Oclose}; }

/// What a soft or external link holds; empty where it cannot be read.
std::string value_of(hid_t group, const std::string& name, std::size_t size) {
  if (size == 0 || size > longest_link) return {};
  std::string value(size, '\0');
  if (H5Lget_val(group, name.c_str(), value.data(), size, H5P_DEFAULT) < 0) return {};
  return value;
}

bool lies_within(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

/// HDF5's reason, and what to do about it.
std::string advice(const fs::path& path, const std::string& why) {
  if (why.find("unable to lock file") != std::string::npos)
    return fmt::format(
        "is locked: another program writes it, or its folder's locks fail (HDF5: {}); wait until it is "
        "written, or, where nobody writes it, set HDF5_USE_FILE_LOCKING=FALSE",
        why);
  if (why.find("already open for write") != std::string::npos)
    return fmt::format(
        "is marked as being written (HDF5: {}); wait until it is written, or, where its writer died, take "
        "the "
        "mark away: h5clear -s {}",
        why, path.string());
  return fmt::format("cannot be opened as HDF5: missing, truncated or damaged (HDF5: {})", why);
}

fs::path folder_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : "."; }

}  // namespace

// --- files ---

Handle open_to_read(const fs::path& path, bool strong, std::string& why) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  if (strong) H5Pset_fclose_degree(access.id(), H5F_CLOSE_STRONG);
  H5Pset_file_locking(access.id(), true, true);
  Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose);
  if (!file) why = advice(path, reason());
  return file;
}

LinkedFiles::LinkedFiles(const fs::path& first, const fs::path& root, Links links) : links_(links) {
  std::error_code error;
  root_ = fs::absolute(root.empty() ? folder_of(first) : root).lexically_normal();
  if (!root_.has_filename()) root_ = root_.parent_path();  // "folder/." and "folder/" are "folder"
  real_root_ = fs::weakly_canonical(root_, error);
  auto file = std::make_shared<LinkedFile>();
  file->path = first;
  std::string why;
  file->id = open_to_read(first, false, why);
  if (!file->id) throw FileError(fmt::format("{}: {}", first.string(), why));
  const fs::path real = fs::weakly_canonical(first, error);
  file->name = name_of({first, real, {}}, first.filename().string());
  first_ = file;
  open_[real] = first_;
  used_.emplace_back(first_->name, first_->path);
}

LinkedFiles::Target LinkedFiles::target_of(const LinkedFile& from, const std::string& name) const {
  const fs::path stated(name);
  std::error_code error;
  // In the order of HDF5, but for the folders that its environment variables name and the current one.
  std::vector<fs::path> candidates;
  if (stated.is_absolute()) {
    candidates = {stated, folder_of(from.path) / stated.filename()};
  } else {
    candidates = {folder_of(from.path) / stated, folder_of(fs::weakly_canonical(from.path, error)) / stated};
  }
  const auto found = std::find_if(candidates.begin(), candidates.end(), [](const fs::path& path) {
    std::error_code none;
    return fs::is_regular_file(path, none);
  });
  if (found == candidates.end())
    return {{}, {}, fmt::format("file '{}' is missing: there is no {}", name, candidates.front().string())};
  Target target{*found, fs::weakly_canonical(*found, error), {}};
  if (links_ != Links::anywhere && !lies_within(target.real, real_root_))
    target.problem = fmt::format(
        "file '{}' ({}) lies outside the scan's folder {}; `follow_links` reads and hashes it "
        "there, or h5repack --merge -l CONTI IN OUT copies all that is linked into one file",
        name, target.real.string(), root_.string());
  return target;
}

std::string LinkedFiles::name_of(const Target& target, const std::string& stated) const {
  const fs::path as_reached = fs::absolute(target.path).lexically_normal();
  if (lies_within(as_reached, root_)) return as_reached.lexically_relative(root_).generic_string();
  if (lies_within(target.real, real_root_))
    return target.real.lexically_relative(real_root_).generic_string();
  return stated;
}

FilePointer LinkedFiles::open(const LinkedFile& from, const std::string& name, std::string& problem) const {
  const Target target = target_of(from, name);
  problem = target.problem;
  if (!problem.empty()) return nullptr;
  if (auto known = open_[target.real].lock()) return known;
  auto file = std::make_shared<LinkedFile>();
  file->path = target.path;
  file->id = open_to_read(target.path, false, problem);
  file->name = name_of(target, name);
  if (!file->id) {
    problem = fmt::format("{}: {}", target.path.string(), problem);
    return nullptr;
  }
  open_[target.real] = file;
  return file;
}

// --- paths ---

void LinkedFiles::walk(Place& place, const std::string& path) const {
  std::deque<std::string> rest = steps_of(path);
  const auto enter = [&](FilePointer file) {
    place.through.emplace_back(file->name, file->path);
    place.file = std::move(file);
    place.path.clear();
    place.object = root_of(*place.file);
  };
  enter(place.file);
  const auto prepend = [&](const std::string& steps) {
    const auto first = steps_of(steps);
    rest.insert(rest.begin(), first.begin(), first.end());
  };
  for (int links = 0; !rest.empty() && place.object;) {
    const std::string step = rest.front(), here = place.path + "/" + step;
    const std::string shown = fmt::format("{}: {}", place.file->path.string(), here);
    rest.pop_front();
    H5L_info_t info{};
    const bool is_group = H5Iget_type(place.object.id()) == H5I_GROUP;
    if (!is_group || H5Lexists(place.object.id(), step.c_str(), H5P_DEFAULT) <= 0 ||
        H5Lget_info(place.object.id(), step.c_str(), &info, H5P_DEFAULT) < 0) {
      place.object = {};
      return;
    }
    if (info.type == H5L_TYPE_HARD) {
      Handle object(H5Oopen(place.object.id(), step.c_str(), H5P_DEFAULT), H5Oclose);
      // Before the group is closed, which clears what HDF5 says.
      if (!object) place.problem = fmt::format("{}: cannot be opened (HDF5: {})", shown, reason());
      place.object = std::move(object);
      place.path = here;
      continue;
    }
    const std::string value = value_of(place.object.id(), step, info.u.val_size);
    if (++links > most_links) place.problem = shown + ": links run in a circle";
    if (info.type == H5L_TYPE_SOFT) {
      prepend(value.c_str());
      if (value.rfind('/', 0) == 0) {
        place.object = root_of(*place.file);
        place.path.clear();
      }
    } else if (info.type == H5L_TYPE_EXTERNAL) {
      const char *file = nullptr, *object = nullptr;
      unsigned flags = 0;
      std::string why = "cannot be read";
      FilePointer linked;
      if (!value.empty() && H5Lunpack_elink_val(value.data(), value.size(), &flags, &file, &object) >= 0)
        linked = open(*place.file, file, why);
      if (linked) prepend(object);
      else if (place.problem.empty()) place.problem = fmt::format("{}: external link: {}", shown, why);
      if (linked) enter(linked);
    } else {
      place.problem = shown + ": is a link of a kind that is not HDF5's own";
    }
    if (!place.problem.empty()) place.object = {};
  }
}

Place LinkedFiles::follow(const FilePointer& from, const std::string& path) const {
  Place place;
  place.file = from;
  walk(place, path);
  return place;
}

Place LinkedFiles::follow(const FilePointer& from, const std::string& name, const std::string& path) const {
  Place place;
  place.file = name == "." ? from : open(*from, name, place.problem);
  if (place.file) walk(place, path);
  return place;
}

void LinkedFiles::use(const Place& place) const {
  for (const auto& file : place.through)
    if (std::find(used_.begin(), used_.end(), file) == used_.end()) used_.push_back(file);
}

}  // namespace vdvr::io::hdf5
