// See hdf5_virtual.hpp. A mapping of a virtual dataset says: the elements that this selection of mine takes,
// in order, are those that that selection of that dataset takes (HDF5 File Format Specification, VIII.A).
#include "host/files/hdf5/hdf5_virtual.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <list>
#include <map>

#include "host/files/hdf5/hdf5_chunks.hpp"
#include "host/files/hdf5/hdf5_filters.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io::hdf5 {
namespace {

using FilesPointer = std::shared_ptr<const LinkedFiles>;

/// A virtual dataset whose sources are being opened: the open file's number, and where it lies in it.
using Ancestors = std::vector<std::pair<unsigned long, haddr_t>>;
constexpr std::size_t deepest = 16;
constexpr std::size_t most_open = 64;
constexpr std::size_t most_mappings = 1 << 20;

Dataset open_numeric(const FilesPointer& files, Place place, std::string name, const Ancestors& ancestors);

// --- selections ---

Handle space_of(const Shape& shape) {
  const std::vector<hsize_t> extents(shape.begin(), shape.end());
  if (extents.empty()) return {H5Screate(H5S_SCALAR), H5Sclose};
  return {H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose};
}

/// "All" written as a block, which is what HDF5 intersects and projects. A scalar stays as it is.
void spell_out(const Handle& space) {
  std::vector<hsize_t> count(H5S_MAX_RANK), start(H5S_MAX_RANK, 0);
  if (H5Sget_select_type(space.id()) == H5S_SEL_ALL &&
      H5Sget_simple_extent_dims(space.id(), count.data(), nullptr) > 0)
    H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
}

Handle spelled_copy(hid_t space) {
  Handle copy(H5Scopy(space), H5Sclose);
  spell_out(copy);
  return copy;
}

std::uint64_t points(const Handle& space) {
  return static_cast<std::uint64_t>(std::max<hssize_t>(H5Sget_select_npoints(space.id()), 0));
}

struct Box {
  std::vector<hsize_t> low, high;
};

/// Nothing where nothing is selected.
std::optional<Box> box_of(hid_t space) {
  const auto rank = static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space), 0));
  Box box{std::vector<hsize_t>(rank), std::vector<hsize_t>(rank)};
  if (rank == 0 || H5Sget_select_npoints(space) <= 0 ||
      H5Sget_select_bounds(space, box.low.data(), box.high.data()) < 0)
    return std::nullopt;
  return box;
}

bool apart(const Box& a, const Box& b) {
  for (std::size_t i = 0; i < a.low.size(); ++i)
    if (a.high[i] < b.low[i] || b.high[i] < a.low[i]) return true;
  return false;
}

bool fits(const Box& box, const Shape& shape) {
  if (box.high.size() != shape.size()) return false;
  for (std::size_t i = 0; i < shape.size(); ++i)
    if (box.high[i] >= shape[i]) return false;
  return true;
}

// --- mappings ---

/// "%%" stands for one "%". Nothing for a pattern.
std::optional<std::string> plain_name(const std::string& name) {
  std::string plain;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] == '%' && (++i == name.size() || name[i] != '%')) return std::nullopt;
    plain += name[i];
  }
  return plain;
}

template <class Get>
std::optional<std::string> name_by(const Get& get) {
  const ssize_t length = get(nullptr, 0);
  if (length <= 0) return std::nullopt;
  std::string name(static_cast<std::size_t>(length) + 1, '\0');
  if (get(name.data(), name.size()) < 0) return std::nullopt;
  name.resize(static_cast<std::size_t>(length));
  return plain_name(name);
}

struct Source {
  std::string file, dataset;
  Shape shape;
};

struct Mapping {
  Handle here, there;  ///< elements of the virtual dataset, and of the source; as many
  Box box;             ///< around `here`
  std::size_t source = 0;
};

class Sources : public VirtualLayout {
 public:
  Sources(FilesPointer files, FilePointer home, const Dataset& d, Ancestors ancestors)
      : files_(std::move(files)), home_(std::move(home)), name_(d.name), ancestors_(std::move(ancestors)) {
    const Handle creation(H5Dget_create_plist(d.id.id()), H5Pclose), type(H5Dget_type(d.id.id()), H5Tclose);
    std::size_t count = 0;
    if (H5Pget_virtual_count(creation.id(), &count) < 0 || count > most_mappings)
      throw FileError(fmt::format("{}: its mappings cannot be read: damaged", name_));
    for (std::size_t i = 0; i < count; ++i) {
      try {
        add(creation.id(), i, d, type.id());
      } catch (const FileError& e) {
        throw FileError(fmt::format("{}: virtual, mapping {} of {}: {}", name_, i + 1, count, e.what()));
      }
    }
    known_.clear();
    require_no_gap(d);
  }

  std::optional<std::string> read(hid_t wanted_by_caller, hid_t memory_of_caller,
                                  double* out) const override {
    const Handle wanted = spelled_copy(wanted_by_caller), memory = spelled_copy(memory_of_caller);
    const auto box = box_of(wanted.id());
    if (!box) return std::nullopt;
    std::uint64_t found = 0;
    for (const Mapping& m : mappings_) {
      if (apart(*box, m.box)) continue;
      const Handle to(H5Sselect_project_intersection(wanted.id(), memory.id(), m.here.id()), H5Sclose);
      const bool scalar = sources_[m.source].shape.empty();
      const Handle from(scalar ? H5Scopy(m.there.id())
                               : H5Sselect_project_intersection(m.here.id(), m.there.id(), wanted.id()),
                        H5Sclose);
      if (!to || !from) return fmt::format("a mapping cannot be cut to size (HDF5: {})", reason());
      const std::uint64_t n = points(to);
      if (n == 0) continue;
      if (points(from) != n) return fmt::format("a mapping gives {} elements for {}", points(from), n);
      const Dataset& source = opened(m.source);
      if (auto problem = source.read_selected(from.id(), to.id(), out))
        return fmt::format("its source {}: {}", source.name, *problem);
      found += n;
    }
    if (found < points(wanted)) return fmt::format("{} elements have no source", points(wanted) - found);
    return std::nullopt;
  }

 private:
  [[nodiscard]] Dataset open(const Source& s) const {
    Place place = files_->follow(home_, s.file, s.dataset);
    if (!place.problem.empty()) throw FileError(place.problem);
    const std::string shown = s.file == "." ? home_->path.string() : s.file;
    if (!place.object) throw FileError(fmt::format("file '{}' has no dataset '{}'", shown, s.dataset));
    std::string name = fmt::format("{}: {}", place.file->path.string(), s.dataset);
    return open_numeric(files_, std::move(place), std::move(name), ancestors_);
  }

  const Dataset& opened(std::size_t index) const {
    const auto it =
        std::find_if(open_.begin(), open_.end(), [&](const auto& entry) { return entry.first == index; });
    if (it != open_.end()) {
      open_.splice(open_.begin(), open_, it);
      return open_.front().second;
    }
    Dataset d = open(sources_[index]);
    if (d.shape != sources_[index].shape) throw FileError(d.name + ": was changed while it was read");
    if (open_.size() >= most_open) open_.pop_back();
    open_.emplace_front(index, std::move(d));
    return open_.front().second;
  }

  void require_same_type(const Dataset& source, hid_t type) const {
    const Handle theirs(H5Dget_type(source.id.id()), H5Tclose);
    const Handle a(H5Tget_native_type(theirs.id(), H5T_DIR_ASCEND), H5Tclose),
        b(H5Tget_native_type(type, H5T_DIR_ASCEND), H5Tclose);
    if (a && b && H5Tequal(a.id(), b.id()) > 0) return;
    const auto words = [](hid_t t) {
      const bool sign = H5Tget_class(t) == H5T_INTEGER && H5Tget_sign(t) == H5T_SGN_NONE;
      return type_name(H5Tget_class(t), H5Tget_size(t)) + (sign ? " without sign" : "");
    };
    throw FileError(
        fmt::format("{} holds {}, the virtual dataset {}", source.name, words(theirs.id()), words(type)));
  }

  /// Opens a source that is new, and gives its number.
  std::size_t source_number(const std::string& file, const std::string& dataset, hid_t type) {
    const auto key = std::pair(file, dataset);
    if (const auto it = known_.find(key); it != known_.end()) return it->second;
    Source s{file, dataset, {}};
    const Dataset d = open(s);
    require_same_type(d, type);
    s.shape = d.shape;
    sources_.push_back(std::move(s));
    return known_[key] = sources_.size() - 1;
  }

  void add(hid_t creation, std::size_t i, const Dataset& d, hid_t type) {
    const auto file =
        name_by([&](char* to, std::size_t n) { return H5Pget_virtual_filename(creation, i, to, n); });
    const auto dataset =
        name_by([&](char* to, std::size_t n) { return H5Pget_virtual_dsetname(creation, i, to, n); });
    if (!file || !dataset) throw FileError("the source's name is empty or a pattern, which is not read");
    Mapping m;
    m.here = Handle(H5Pget_virtual_vspace(creation, i), H5Sclose);
    const Handle stated(H5Pget_virtual_srcspace(creation, i), H5Sclose);
    for (const hid_t space : {m.here.id(), stated.id()})
      if (const auto kind = H5Sget_select_type(space); kind != H5S_SEL_ALL && kind != H5S_SEL_HYPERSLABS)
        throw FileError("its selection is neither all nor of blocks: damaged");
    m.source = source_number(*file, *dataset, type);
    const Source& s = sources_[m.source];
    spell_out(m.here);
    const auto box = box_of(m.here.id());
    if (!box || !fits(*box, d.shape) || !has_shape(m.here, d.shape))
      throw FileError(
          fmt::format("takes elements beyond the virtual dataset's shape [{}]", fmt::join(d.shape, ", ")));
    m.box = *box;
    m.there = space_of(s.shape);
    if (H5Sget_select_type(stated.id()) == H5S_SEL_HYPERSLABS) {
      const auto theirs = box_of(stated.id());
      if (!theirs || !fits(*theirs, s.shape) || H5Sselect_copy(m.there.id(), stated.id()) < 0)
        throw FileError(
            fmt::format("{} in '{}' has the shape [{}], too small for what is taken of it{}", s.dataset,
                        s.file, fmt::join(s.shape, ", "),
                        theirs ? fmt::format(", up to [{}]", fmt::join(theirs->high, ", ")) : ""));
    }
    spell_out(m.there);
    if (points(m.here) != points(m.there))
      throw FileError(fmt::format("{} in '{}' has the shape [{}] and gives {} elements where {} are needed",
                                  s.dataset, s.file, fmt::join(s.shape, ", "), points(m.there),
                                  points(m.here)));
    mappings_.push_back(std::move(m));
  }

  static bool has_shape(const Handle& space, const Shape& shape) {
    std::vector<hsize_t> extents(H5S_MAX_RANK);
    const int rank = H5Sget_simple_extent_dims(space.id(), extents.data(), nullptr);
    return rank >= 0 && std::equal(shape.begin(), shape.end(), extents.begin(), extents.begin() + rank);
  }

  void require_no_gap(const Dataset& d) const {
    const Handle left = space_of(d.shape);
    spell_out(left);
    // One after the other off the whole; each piece is cut from a shrinking list when mappings are in order.
    for (const Mapping& m : mappings_)
      if (points(left) > 0 && H5Smodify_select(left.id(), H5S_SELECT_NOTB, m.here.id()) < 0)
        throw FileError(fmt::format("{}: its mappings cannot be added up (HDF5: {})", name_, reason()));
    if (points(left) == 0 || d.count == 0) return;
    const auto box = box_of(left.id());
    throw FileError(
        fmt::format("{}: virtual, and {} of its {} elements have no source, from [{}] on; HDF5 would read "
                    "fill values there",
                    name_, points(left), d.count, box ? fmt::format("{}", fmt::join(box->low, ", ")) : ""));
  }

  FilesPointer files_;
  FilePointer home_;
  std::string name_;
  Ancestors ancestors_;
  std::vector<Source> sources_;
  std::vector<Mapping> mappings_;
  std::map<std::pair<std::string, std::string>, std::size_t> known_;  ///< while mappings are added
  mutable std::list<std::pair<std::size_t, Dataset>> open_;           ///< the last used one first
};

// --- datasets ---

void set_sources(const FilesPointer& files, FilePointer home, Dataset& d, Ancestors ancestors) {
  H5O_info_t info{};
  if (H5Oget_info2(d.id.id(), &info, H5O_INFO_BASIC) < 0) throw FileError(d.name + ": " + reason());
  const std::pair own(info.fileno, info.addr);
  if (std::find(ancestors.begin(), ancestors.end(), own) != ancestors.end())
    throw FileError(d.name + ": is a source of its own: virtual datasets run in a circle");
  if (ancestors.size() >= deepest)
    throw FileError(
        fmt::format("{}: virtual datasets of virtual datasets, more than {} deep", d.name, deepest));
  if (d.shape.empty()) throw FileError(d.name + ": is virtual and no array");
  ancestors.push_back(own);
  d.virtual_layout = std::make_shared<Sources>(files, std::move(home), d, std::move(ancestors));
}

std::uint64_t missing_chunks_of(const Dataset& d) {
  if (d.layout != H5D_CHUNKED) return 0;
  const Handle space(H5Dget_space(d.id.id()), H5Sclose);
  hsize_t stored = 0;
  if (H5Dget_num_chunks(d.id.id(), space.id(), &stored) < 0)
    throw FileError(fmt::format("{}: has an index that cannot be read: truncated or damaged", d.name));
  std::uint64_t needed = 1;
  for (std::size_t a = 0; a < std::min(d.chunk.size(), d.shape.size()); ++a)
    needed = d.shape[a] == 0 || d.chunk[a] == 0
                 ? 0
                 : saturating_product(needed, (d.shape[a] - 1) / d.chunk[a] + 1);
  return needed > stored ? needed - stored : 0;
}

Dataset open_numeric(const FilesPointer& files, Place place, std::string name, const Ancestors& ancestors) {
  Dataset d = declare(std::move(place.object), std::move(name));
  if (!d.is_number()) throw FileError(d.name + ": is not numeric");
  files->use(place);
  if (d.layout == H5D_VIRTUAL) {
    set_sources(files, place.file, d, ancestors);
    return d;
  }
  if (d.outside)
    throw FileError(d.name +
                    ": its numbers lie in files of no format (external storage), which are not read; "
                    "h5repack -l CONTI IN OUT copies them into one file");
  const bool null = d.shape.empty() && d.count == 0;
  if (null || H5Dget_storage_size(d.id.id()) == 0) throw FileError(d.name + ": holds no data");
  if (const auto problem = check_extents(d)) throw FileError(fmt::format("{}: {}", d.name, *problem));
  if (const auto problem = check_filters_present(d)) throw FileError(fmt::format("{}: {}", d.name, *problem));
  d.missing_chunks = missing_chunks_of(d);
  return d;
}

}  // namespace

Dataset numeric_dataset(const FilesPointer& files, Place place, std::string name) {
  return open_numeric(files, std::move(place), std::move(name), {});
}

}  // namespace vdvr::io::hdf5
