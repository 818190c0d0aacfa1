// Which scan an HDF5 file holds: Data Exchange, else one of its NXtomo entries.
#include "host/scan/raw/hdf5_scan.hpp"

#include <fmt/format.h>

#include "host/scan/raw/data_exchange.hpp"
#include "host/scan/raw/nxtomo.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

using hdf5::Reader;

// "/entry/tomo" of "entry/tomo/".
std::string group_of(std::string name) {
  while (!name.empty() && name.back() == '/') name.pop_back();
  return name.empty() || name.front() == '/' ? name : "/" + name;
}

std::string shown(const TomoEntry& entry) { return entry.entry.empty() ? "/" : entry.entry.substr(1); }

std::string list_of(const std::vector<TomoEntry>& entries) {
  std::string text;
  for (const TomoEntry& entry : entries) text += (text.empty() ? "" : ", ") + shown(entry);
  return text.empty() ? "none" : text;
}

bool is_named(const TomoEntry& entry, const std::string& group) {
  return entry.entry == group || (group.find('/', 1) == std::string::npos && entry.entry.ends_with(group));
}

RawScan open_named(const Reader& file, const Hdf5Wanted& wanted) {
  const std::string group = group_of(wanted.entry);
  if (!group.empty() && is_data_exchange(file, group)) return open_data_exchange(file, group, wanted);
  std::vector<TomoEntry> entries = tomo_entries(file);
  const std::string all = list_of(entries);
  std::erase_if(entries, [&](const TomoEntry& entry) { return !is_named(entry, group); });
  if (entries.empty())
    throw FileError(fmt::format("{}: `entry` '{}' holds no scan; the file's NXtomo entries: {}", file.path(),
                                wanted.entry, all));
  if (entries.size() > 1)
    throw FileError(fmt::format("{}: `entry` '{}' fits several groups: {}; give the whole path", file.path(),
                                wanted.entry, list_of(entries)));
  return open_nxtomo(file, entries.front(), wanted);
}

RawScan open_only(const Reader& file, const Hdf5Wanted& wanted) {
  if (file.is_dataset("/exchange/data")) {
    RawScan scan = open_data_exchange(file, "/exchange", wanted);
    for (const std::string& name : file.members("/"))
      if (name.starts_with("exchange_") && is_data_exchange(file, "/" + name))
        scan.notes.push_back(fmt::format("the file also holds /{0}/data; `entry` {0} reads that", name));
    return scan;
  }
  std::vector<TomoEntry> entries = tomo_entries(file);
  if (!entries.empty()) {
    // A scan's own groups may hold copies of it deeper down.
    std::erase_if(entries,
                  [top = entries.front().depth](const TomoEntry& entry) { return entry.depth > top; });
    if (entries.size() > 1)
      throw FileError(fmt::format("{}: holds {} scans: {}; choose one by `entry`", file.path(),
                                  entries.size(), list_of(entries)));
    return open_nxtomo(file, entries.front(), wanted);
  }
  if (file.find_text("/", "format") == "vdvr")
    throw FileError(file.path() + ": is a certified volume, not a scan");
  throw FileError(fmt::format(
      "{}: HDF5, but neither Data Exchange (/exchange/data) nor NXtomo (instrument/detector with data and "
      "image_key){}",
      file.path(),
      file.broken_link().empty() ? "" : "; a link could not be followed: " + file.broken_link()));
}

}  // namespace

RawScan open_hdf5_scan(const std::filesystem::path& path, const std::filesystem::path& folder,
                       bool follow_links, const Hdf5Wanted& wanted) {
  const Reader file(path, follow_links ? hdf5::Links::anywhere : hdf5::Links::within_folder, folder);
  RawScan scan = wanted.entry.empty() ? open_only(file, wanted) : open_named(file, wanted);
  if (wanted.beam == Beam::cone && !scan.cone)
    throw FileError(
        path.string() +
        ": Data Exchange states no distances, so cone beam (`beam`) cannot be read from it; describe "
        "the scan in scan.json by 'geometry'");
  scan.files = file.used();
  if (scan.files.size() > 1)
    scan.notes.push_back(
        fmt::format("its numbers lie in {} HDF5 files; the hash covers all", scan.files.size()));
  return scan;
}

}  // namespace vdvr::io
