// Chunks lie in a plane: slices across z, which viewers ask for, read no other one.
#include "host/export/hdf5_sink.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/export/pack.hpp"
#include "host/files/hdf5/hdf5_writer.hpp"
#include "host/files/io/length_unit.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;
namespace h5 = io::hdf5;

constexpr const char* dataset = "/volume";
// As in .vdvr files (docs/file-format.md, Compression).
constexpr int deflate_level = 4;

/// Micrometres per unit; nothing where the unit is none of length.
std::optional<double> micrometres(const std::string& unit) {
  if (const auto exponent = metres_exponent(unit)) return power_of_ten(*exponent + 6);
  return std::nullopt;
}

class Hdf5Sink : public VolumeSink {
 public:
  Hdf5Sink(const fs::path& path, const ExportNote& note, Compression compression)
      : path_(path),
        element_(bytes_of(note.samples)),
        packed_(compression == Compression::deflate),
        file_(path),
        writer_(file_.temporary(), path, {}) {
    const Index3 n = note.grid.samples();
    for (std::size_t a = 0; a < 3; ++a) shape_.push_back(static_cast<std::uint64_t>(n[2 - a]));
    const std::uint64_t bytes = io::checked_bytes(n, element_, path.string());
    if (!packed_) require_disk(path, file_.temporary(), bytes);
    chunk_ = h5::chunk_shape(shape_, element_);
    const hid_t type = note.samples == SampleType::f32   ? h5::element_type<float>()
                       : note.samples == SampleType::u16 ? h5::element_type<std::uint16_t>()
                                                         : h5::element_type<std::uint8_t>();
    dataset_ = writer_.chunked_dataset(dataset, shape_, chunk_, type, packed_ ? deflate_level : 0);
    describe(note);
  }
  [[nodiscard]] std::int64_t planes_together() const override { return static_cast<std::int64_t>(chunk_[0]); }

  void put(std::int64_t first, std::span<const std::byte> planes) override {
    const std::uint64_t plane = shape_[1] * shape_[2] * element_, depth = planes.size() / plane;
    std::vector<h5::Shape> places;
    for (std::uint64_t z = 0; z < depth; z += chunk_[0])
      for (std::uint64_t y = 0; y < shape_[1]; y += chunk_[1])
        for (std::uint64_t x = 0; x < shape_[2]; x += chunk_[2]) places.push_back({z, y, x});
    // As many as the cores have work for; then they are written, in order, so that equal volumes give equal
    // files.
    constexpr std::size_t together = 32;
    for (std::size_t begin = 0; begin < places.size(); begin += together) {
      const std::size_t count = std::min(together, places.size() - begin);
      std::vector<Bytes> chunks(count);
      parallel_for(static_cast<std::int64_t>(count), {}, "export", [&](std::int64_t i) {
        const auto n = static_cast<std::size_t>(i);
        chunks[n] = chunk_at(planes, depth, places[begin + n]);
      });
      for (std::size_t i = 0; i < count; ++i) {
        h5::Shape place = places[begin + i];
        place[0] += static_cast<std::uint64_t>(first);
        writer_.chunk(dataset_, place, chunks[i]);
      }
    }
  }
  std::uint64_t commit() override {
    static_cast<void>(dataset_.close());
    writer_.close();
    const std::uint64_t bytes = fs::file_size(file_.temporary());
    file_.commit();
    return bytes;
  }

 private:
  void describe(const ExportNote& note) {
    const auto zyx = [](const Vec3& v) { return std::array<double, 3>{v[2], v[1], v[0]}; };
    writer_.attribute(dataset, "spacing", zyx(note.grid.spacing));
    writer_.attribute(dataset, "origin", zyx(note.grid.origin));
    writer_.attribute(dataset, "unit", note.grid.unit);
    if (const auto um = micrometres(note.grid.unit)) {
      Vec3 size = note.grid.spacing;
      for (double& s : size) s *= *um;
      writer_.attribute(dataset, "element_size_um", zyx(size));
    }
    writer_.attribute(dataset, "scale", note.scale);
    writer_.attribute(dataset, "offset", note.offset);
    if (note.certified) {
      writer_.attribute(dataset, "epsilon", note.epsilon);
      writer_.attribute(dataset, "epsilon_abs", note.epsilon_abs);
    }
    if (note.content_sha256.empty()) return;
    writer_.attribute(dataset, "exact_between_samples", std::int64_t{note.exact_between_samples});
    writer_.attribute(dataset, "content_sha256", note.content_sha256);
  }

  /// The samples of a chunk, zeros beyond the volume, in the form of the filters.
  [[nodiscard]] Bytes chunk_at(std::span<const std::byte> planes, std::uint64_t depth,
                               const h5::Shape& place) const {
    Bytes bytes(chunk_[0] * chunk_[1] * chunk_[2] * element_);
    const std::uint64_t length = std::min(chunk_[2], shape_[2] - place[2]) * element_;
    for (std::uint64_t z = 0; z < std::min(chunk_[0], depth - place[0]); ++z)
      for (std::uint64_t y = 0; y < std::min(chunk_[1], shape_[1] - place[1]); ++y) {
        const std::uint64_t from =
            (((place[0] + z) * shape_[1] + place[1] + y) * shape_[2] + place[2]) * element_;
        std::copy_n(planes.begin() + static_cast<std::ptrdiff_t>(from), length,
                    bytes.begin() + static_cast<std::ptrdiff_t>((z * chunk_[1] + y) * chunk_[2] * element_));
      }
    if (!packed_) return bytes;
    if (element_ > 1) bytes = shuffled(bytes, element_);
    return packed(bytes, Wrapper::zlib, deflate_level);
  }

  fs::path path_;
  std::size_t element_;
  bool packed_;
  io::AtomicFile file_;
  h5::Writer writer_;
  h5::Shape shape_, chunk_;
  h5::Handle dataset_;
};

}  // namespace

std::unique_ptr<VolumeSink> hdf5_sink(const fs::path& path, const ExportNote& note, Compression compression) {
  return std::make_unique<Hdf5Sink>(path, note, compression);
}

}  // namespace vdvr
