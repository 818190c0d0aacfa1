// MetaImage and NRRD by our own parser; see raster_file.hpp. Field names follow the MetaIO and NRRD
// definitions.
#include "host/files/io/raster_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <vector>

#include "host/base/system/limits.hpp"
#include "host/base/system/lower.hpp"
#include "host/files/io/number_text.hpp"
#include "host/files/io/text_encoding.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;
using Fields = std::map<std::string, std::string>;

std::string trimmed(std::string_view text) { return std::string(without_blanks(text)); }

// What a header may hold, parsed: the fields, and where the samples start when they follow it.
class HeaderText {
 public:
  explicit HeaderText(const fs::path& path) : path_(path), file_(path, std::ios::binary) {
    std::error_code error;
    if (!fs::is_regular_file(path, error) || !file_)
      throw FileError(path.string() + ": no such file, or not readable");
    if (fs::file_size(path, error) == 0) throw FileError(path.string() + ": is empty");
  }

  /// One line without its end; false at the end of the file. A header is short: a line without end is not
  /// one.
  bool line(std::string& text) {
    constexpr std::size_t longest = 1 << 16;
    text.clear();
    for (char c = 0; file_.get(c);) {
      if (c == '\n') {
        if (!text.empty() && text.back() == '\r') text.pop_back();
        return true;
      }
      text += c;
      if (text.size() > longest || (read_ += 1) > 16 * longest) fail("has no readable header");
    }
    return !text.empty();
  }
  /// Of the next byte; the end of the file where the header took all of it.
  std::uint64_t position() {
    std::error_code error;
    const std::streamoff at = file_.tellg();
    return at >= 0 ? static_cast<std::uint64_t>(at) : fs::file_size(path_, error);
  }

  [[noreturn]] void fail(const std::string& what) const { throw FileError(path_.string() + ": " + what); }
  void set(const std::string& key, const std::string& value) { fields_[key] = value; }
  const std::string* find(const std::string& key) const {
    const auto it = fields_.find(key);
    return it == fields_.end() ? nullptr : &it->second;
  }
  const std::string& need(const std::string& key) const {
    if (const auto* value = find(key)) return *value;
    fail(fmt::format("header has no '{}': truncated, or not the format its first line says", key));
  }
  /// NRRD writes vectors as (a,b,c): brackets and commas count as blanks.
  std::vector<double> numbers(const std::string& key, std::size_t count, bool nan_is_unknown = false) const {
    std::string text = need(key);
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
    std::istringstream in(text);
    std::vector<double> values;
    for (std::string word; in >> word;) {
      char* end = nullptr;
      values.push_back(std::strtod(word.c_str(), &end));
      if (*end != '\0' || (!std::isfinite(values.back()) && !(nan_is_unknown && std::isnan(values.back()))))
        fail(fmt::format("'{}' holds '{}', not a number{}", key, word, comma_hint(word)));
    }
    if (values.size() != count)
      fail(fmt::format("'{}' holds {} numbers, {} are needed", key, values.size(), count));
    return values;
  }
  std::int64_t integer(const std::string& key) const {
    const double value = numbers(key, 1)[0];
    constexpr double exact = 0x1p53;
    if (value != std::floor(value) || std::abs(value) > exact)
      fail(fmt::format("'{}' is {}, not an integer", key, value));
    return static_cast<std::int64_t>(value);
  }
  std::array<std::int64_t, 3> sizes(const std::string& key) const {
    const auto values = numbers(key, 3);
    std::array<std::int64_t, 3> n{};
    for (std::size_t a = 0; a < 3; ++a) {
      // 2^31 samples along an axis is beyond any detector or volume and keeps products within 64 bits
      // checkable.
      if (!(values[a] >= 1 && values[a] <= 0x1p31) || values[a] != std::floor(values[a]))
        fail(fmt::format("'{}' has {} along axis {}", key, values[a], a));
      n[a] = static_cast<std::int64_t>(values[a]);
    }
    return n;
  }
  bool flag(const std::string& key, bool fallback) const {
    const auto* value = find(key);
    if (!value) return fallback;
    const std::string text = lower(*value);
    if (text == "true" || text == "1") return true;
    if (text == "false" || text == "0") return false;
    fail(fmt::format("'{}' is '{}', neither True nor False", key, *value));
  }
  /// The file of the samples, which must lie in the header's folder.
  fs::path beside(const std::string& name) const {
    const fs::path relative(name);
    if (name.empty() || relative.is_absolute() ||
        std::find(relative.begin(), relative.end(), "..") != relative.end())
      fail(fmt::format("samples in '{}': they must lie in the header's folder", name));
    return path_.parent_path() / relative;
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  std::ifstream file_;
  Fields fields_;
  std::size_t read_ = 0;
};

void set_spacing(const HeaderText& header, RasterHeader& out, const std::vector<double>& spacing) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::isnan(spacing[a])) continue;  // not known, as NRRD has it
    if (!(spacing[a] > 0))
      header.fail(fmt::format("spacing {} along axis {}; it must be positive", spacing[a], a));
    out.spacing[a] = spacing[a];
  }
}

void set_axes(const HeaderText& header, const std::string& key, const AxisDirections& directions,
              RasterHeader& out) {
  if (const std::string wrong = straight_axes(directions, out.samples, out.spacing, out.axes); !wrong.empty())
    header.fail(fmt::format("'{}' {}", key, wrong));
}

// --- MetaImage ---

void set_met_type(const HeaderText& header, const std::string& name, RasterHeader& out) {
  using enum ScalarKind;
  static const std::map<std::string, std::pair<ScalarKind, int>> types{
      {"MET_CHAR", {signed_integer, 1}},      {"MET_UCHAR", {unsigned_integer, 1}},
      {"MET_SHORT", {signed_integer, 2}},     {"MET_USHORT", {unsigned_integer, 2}},
      {"MET_INT", {signed_integer, 4}},       {"MET_UINT", {unsigned_integer, 4}},
      {"MET_LONG", {signed_integer, 4}},      {"MET_ULONG", {unsigned_integer, 4}},
      {"MET_LONG_LONG", {signed_integer, 8}}, {"MET_ULONG_LONG", {unsigned_integer, 8}},
      {"MET_FLOAT", {floating, 4}},           {"MET_DOUBLE", {floating, 8}}};
  const auto it = types.find(name);
  if (it == types.end())
    header.fail(fmt::format("ElementType '{}' is not a scalar type that can be read", name));
  out.kind = it->second.first;
  out.sample_bytes = it->second.second;
}

void set_met_geometry(const HeaderText& header, RasterHeader& out) {
  for (const char* key : {"Offset", "Position", "Origin"})
    if (header.find(key)) {
      const auto origin = header.numbers(key, 3);
      std::copy(origin.begin(), origin.end(), out.origin.begin());
    }
  const char* spacing = header.find("ElementSpacing") ? "ElementSpacing" : "ElementSize";
  if (header.find(spacing)) set_spacing(header, out, header.numbers(spacing, 3));
  for (const char* key : {"TransformMatrix", "Rotation", "Orientation"}) {
    if (!header.find(key)) continue;
    // Three numbers an axis of the file: its direction, of length 1.
    const auto m = header.numbers(key, 9);
    AxisDirections directions{};
    for (std::size_t i = 0; i < 9; ++i) directions[i / 3][i % 3] = m[i] * out.spacing[i / 3];
    set_axes(header, key, directions, out);
  }
  // MetaImage lengths are millimetres unless it says otherwise; units it has no name for go into our Comment.
  out.unit = header.find(spacing) ? "mm" : "";
  if (const auto* unit = header.find("DistanceUnits"); unit && *unit != "?") out.unit = *unit;
  const std::string mark = "unit: ";
  if (const auto* comment = header.find("Comment"); comment && comment->rfind(mark, 0) == 0)
    out.unit = comment->substr(mark.size());
}

RasterHeader read_meta_image(HeaderText& header) {
  std::string text;
  bool complete = false;
  while (!complete && header.line(text)) {
    const auto equals = text.find('=');
    if (equals == std::string::npos)
      header.fail(fmt::format("header line '{}' has no '='", text.substr(0, 40)));
    const std::string key = trimmed(text.substr(0, equals));
    header.set(key, trimmed(text.substr(equals + 1)));
    complete = key == "ElementDataFile";  // always the last field
  }
  RasterHeader out;
  out.file = header.path();
  out.format = "mha";
  const std::string& data = header.need("ElementDataFile");
  if (header.integer("NDims") != 3)
    header.fail(fmt::format("NDims is {}, 3 are needed", header.need("NDims")));
  if (header.find("ElementNumberOfChannels") && header.integer("ElementNumberOfChannels") != 1)
    header.fail("has several channels per element; one is needed");
  if (!header.flag("BinaryData", true)) header.fail("BinaryData = False (text samples) is not supported");
  out.samples = header.sizes("DimSize");
  set_met_type(header, header.need("ElementType"), out);
  set_met_geometry(header, out);
  out.big_endian = header.flag("BinaryDataByteOrderMSB", header.flag("ElementByteOrderMSB", false));
  out.gzip = header.flag("CompressedData", false);
  if (data == "LOCAL") {
    out.data_file = header.path();
    out.data_offset = header.position();
  } else if (data.rfind("LIST", 0) == 0 || data.find('%') != std::string::npos) {
    header.fail(fmt::format("ElementDataFile = {} (one file per slice) is not supported", data));
  } else {
    out.data_file = header.beside(data);
    const std::int64_t skip = header.find("HeaderSize") ? header.integer("HeaderSize") : 0;
    out.data_at_end = skip < 0;
    out.data_offset = static_cast<std::uint64_t>(std::max<std::int64_t>(skip, 0));
  }
  return out;
}

// --- NRRD ---

void set_nrrd_type(const HeaderText& header, const std::string& name, RasterHeader& out) {
  using enum ScalarKind;
  static const std::map<std::string, std::pair<ScalarKind, int>> types = [] {
    std::map<std::string, std::pair<ScalarKind, int>> t;
    for (const char* n : {"signed char", "int8", "int8_t"}) t[n] = {signed_integer, 1};
    for (const char* n : {"uchar", "unsigned char", "uint8", "uint8_t"}) t[n] = {unsigned_integer, 1};
    for (const char* n : {"short", "short int", "signed short", "signed short int", "int16", "int16_t"})
      t[n] = {signed_integer, 2};
    for (const char* n : {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"})
      t[n] = {unsigned_integer, 2};
    for (const char* n : {"int", "signed int", "int32", "int32_t"}) t[n] = {signed_integer, 4};
    for (const char* n : {"uint", "unsigned int", "uint32", "uint32_t"}) t[n] = {unsigned_integer, 4};
    for (const char* n : {"longlong", "long long", "long long int", "signed long long", "int64", "int64_t"})
      t[n] = {signed_integer, 8};
    for (const char* n : {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"})
      t[n] = {unsigned_integer, 8};
    t["float"] = {floating, 4};
    t["double"] = {floating, 8};
    return t;
  }();
  const auto it = types.find(lower(name));
  if (it == types.end()) header.fail(fmt::format("type '{}' is not a scalar type that can be read", name));
  out.kind = it->second.first;
  out.sample_bytes = it->second.second;
}

void set_nrrd_geometry(const HeaderText& header, RasterHeader& out) {
  for (const char* key : {"axis mins", "axismins", "axis maxs", "axismaxs"})
    if (header.find(key))
      header.fail(fmt::format("'{}' is not supported; give 'space origin' and 'space directions'", key));
  if (header.find("spacings")) set_spacing(header, out, header.numbers("spacings", 3, true));
  if (header.find("space directions")) {
    const auto m = header.numbers("space directions", 9);
    AxisDirections directions{};
    for (std::size_t i = 0; i < 9; ++i) directions[i / 3][i % 3] = m[i];
    for (std::size_t f = 0; f < 3; ++f)
      out.spacing[f] = std::max({std::abs(m[3 * f]), std::abs(m[3 * f + 1]), std::abs(m[3 * f + 2])});
    set_axes(header, "space directions", directions, out);
  }
  if (header.find("space origin")) {
    const auto origin = header.numbers("space origin", 3, true);
    for (std::size_t a = 0; a < 3; ++a)
      if (!std::isnan(origin[a])) out.origin[a] = origin[a];
  }
  for (const char* key : {"space units", "units"})
    if (const auto* units = header.find(key)) {
      const auto first = units->find('"'), last = units->find('"', first + 1);
      if (first != std::string::npos && last != std::string::npos)
        out.unit = units->substr(first + 1, last - first - 1);
    }
}

/// The byte after so many line ends.
std::uint64_t after_lines(const fs::path& path, std::uint64_t from, std::int64_t lines) {
  if (lines == 0) return from;
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(from));
  std::string block(1 << 16, '\0');
  for (std::uint64_t at = from;; at += block.size()) {
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    block.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    for (std::size_t i = 0; i < block.size(); ++i)
      if (block[i] == '\n' && --lines == 0) return at + i + 1;
    if (block.empty())
      throw FileError(fmt::format("{}: ends {} lines before the samples that 'line skip' leads to",
                                  path.string(), lines));
  }
}

RasterHeader read_nrrd(HeaderText& header) {
  std::string text;
  header.line(text);  // the magic, checked by the caller
  while (header.line(text) && !text.empty()) {
    const auto colon = text.find(':');
    if (text[0] == '#' || (colon != std::string::npos && text.compare(colon, 2, ":=") == 0)) continue;
    if (colon == std::string::npos)
      header.fail(fmt::format("header line '{}' has no ':'", text.substr(0, 40)));
    header.set(lower(trimmed(text.substr(0, colon))), trimmed(text.substr(colon + 1)));
  }
  RasterHeader out;
  out.file = header.path();
  out.format = "nrrd";
  if (header.integer("dimension") != 3)
    header.fail(fmt::format("dimension is {}, 3 is needed", header.need("dimension")));
  out.samples = header.sizes("sizes");
  set_nrrd_type(header, header.need("type"), out);
  set_nrrd_geometry(header, out);
  const std::string encoding = lower(header.need("encoding"));
  if (encoding != "raw" && encoding != "gzip" && encoding != "gz")
    header.fail(fmt::format("encoding '{}' is not supported; use raw or gzip", encoding));
  out.gzip = encoding != "raw";
  if (out.sample_bytes > 1) {
    const std::string endian = lower(header.need("endian"));
    if (endian != "little" && endian != "big") header.fail(fmt::format("endian is '{}'", endian));
    out.big_endian = endian == "big";
  }
  std::int64_t lines = 0, skip = 0;
  for (const char* key : {"line skip", "lineskip"})
    if (header.find(key)) lines = header.integer(key);
  if (lines < 0) header.fail(fmt::format("'line skip' is {}", lines));
  for (const char* key : {"byte skip", "byteskip"})
    if (header.find(key)) skip = header.integer(key);
  if (skip != 0 && out.gzip) header.fail("'byte skip' together with gzip is not supported");
  const std::string* data = header.find("data file") ? header.find("data file") : header.find("datafile");
  if (data && (data->rfind("LIST", 0) == 0 || data->find('%') != std::string::npos))
    header.fail(fmt::format("data file '{}' (one file per slice) is not supported", *data));
  out.data_file = data ? header.beside(*data) : header.path();
  out.data_at_end = skip < 0;
  out.data_offset = after_lines(out.data_file, data ? 0 : header.position(), lines) +
                    static_cast<std::uint64_t>(std::max<std::int64_t>(skip, 0));
  return out;
}

// --- samples ---

void convert_samples(const RasterHeader& h, const unsigned char* from, std::int64_t count, double* out) {
  const bool swap = h.sample_bytes > 1 && h.big_endian != (std::endian::native == std::endian::big);
  convert_numbers(h.kind, h.sample_bytes, from, count, swap, out);
}

// zlib and gzip wrappers alike (MetaImage writes the first, NRRD the second).
std::vector<unsigned char> inflate_all(std::ifstream& file, std::uint64_t bytes, const std::string& name) {
  std::vector<unsigned char> out(bytes);
  std::vector<unsigned char> block(1 << 18);
  z_stream stream{};
  constexpr int detect_wrapper = 15 + 32;
  if (inflateInit2(&stream, detect_wrapper) != Z_OK) throw ResourceError(name + ": zlib cannot start");
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> guard(&stream, &inflateEnd);
  std::uint64_t done = 0;
  int rc = Z_OK;
  while (rc == Z_OK && done < bytes) {
    if (stream.avail_in == 0) {
      file.read(reinterpret_cast<char*>(block.data()), static_cast<std::streamsize>(block.size()));
      stream.next_in = block.data();
      stream.avail_in = static_cast<uInt>(file.gcount());
      if (stream.avail_in == 0) break;
    }
    stream.next_out = out.data() + done;
    stream.avail_out =
        static_cast<uInt>(std::min<std::uint64_t>(bytes - done, std::numeric_limits<uInt>::max()));
    const uInt before = stream.avail_out;
    rc = inflate(&stream, Z_NO_FLUSH);
    done += before - stream.avail_out;
  }
  if (done != bytes || (rc != Z_OK && rc != Z_STREAM_END))
    throw FileError(
        fmt::format("{}: compressed samples are truncated or damaged: {} of {} bytes", name, done, bytes));
  return out;
}

}  // namespace

struct RasterSamples::State {
  RasterHeader header;
  std::ifstream file;
  std::vector<unsigned char> inflated;
};

RasterSamples::RasterSamples(RasterHeader header, std::uint64_t max_memory_bytes)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.header = std::move(header);
  RasterHeader& h = s.header;
  const std::string name = h.data_file.string();
  const std::uint64_t bytes =
      checked_bytes(h.samples, static_cast<std::uint64_t>(h.sample_bytes), h.file.string());
  std::error_code error;
  s.file.open(h.data_file, std::ios::binary);
  if (!fs::is_regular_file(h.data_file, error) || !s.file)
    throw FileError(name + ": the samples' file cannot be opened");
  const std::uint64_t size = fs::file_size(h.data_file, error);
  if (h.data_at_end && size >= bytes) h.data_offset = size - bytes;
  const std::uint64_t present = size - std::min(size, h.data_offset);
  constexpr std::uint64_t tightest_deflate = 1032;  // bytes out per byte in, by the format
  if ((h.gzip ? bytes / tightest_deflate : bytes) > present)
    throw FileError(fmt::format("{}: is truncated: {} samples need {} bytes, {} are there", name,
                                shape_text(h.samples), bytes, present));
  s.file.seekg(static_cast<std::streamoff>(h.data_offset));
  if (!h.gzip) return;
  require_memory(bytes, max_memory_bytes, name);
  s.inflated = inflate_all(s.file, bytes, name);
}

RasterSamples::~RasterSamples() = default;
RasterSamples::RasterSamples(RasterSamples&&) noexcept = default;
const RasterHeader& RasterSamples::header() const { return state_->header; }

void RasterSamples::read(std::int64_t first, std::int64_t count, double* out) {
  State& s = *state_;
  const std::int64_t width = s.header.sample_bytes;
  if (s.header.gzip) return convert_samples(s.header, s.inflated.data() + first * width, count, out);
  std::vector<unsigned char> bytes(static_cast<std::size_t>(count * width));
  s.file.seekg(static_cast<std::streamoff>(s.header.data_offset) + first * width);
  if (!s.file.read(reinterpret_cast<char*>(bytes.data()), count * width))
    throw FileError(fmt::format("{}: cannot be read at sample {}", s.header.data_file.string(), first));
  convert_samples(s.header, bytes.data(), count, out);
}

bool is_raster_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string start(64, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  if (start.rfind("NRRD000", 0) == 0) return true;
  const std::string key = trimmed(start.substr(0, std::min(start.find('='), start.size())));
  static const std::vector<std::string> first_fields{"ObjectType",    "NDims", "Comment",
                                                     "ObjectSubType", "Name",  "ID"};
  return start.find('=') != std::string::npos &&
         std::find(first_fields.begin(), first_fields.end(), key) != first_fields.end();
}

RasterHeader read_raster_header(const fs::path& path) {
  HeaderText header(path);
  if (!is_raster_file(path)) header.fail("is neither MetaImage (.mha) nor NRRD");
  std::ifstream file(path, std::ios::binary);
  char first = 0;
  char second = 0;
  file.get(first).get(second);
  RasterHeader out = first == 'N' && second == 'R' ? read_nrrd(header) : read_meta_image(header);
  checked_bytes(out.samples, sizeof(double), path.string());
  return out;
}

}  // namespace vdvr::io
