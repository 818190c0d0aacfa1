// VTK's XML files: a .vti per block, written on all cores, and the .vtm that lists them.
#include "vdvr/expert/export_vtk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/export/export_note.hpp"
#include "host/export/pack.hpp"
#include "host/export/vtk_partition.hpp"
#include "host/volume/sampler/sample_box.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {
namespace {

namespace fs = std::filesystem;

// VTK's own writers take blocks of 32 KiB; larger ones have fewer sizes to write and pack as well.
constexpr std::uint64_t packed_block_bytes = std::uint64_t{1} << 20;
constexpr int zlib_level = 4;
// Points that are sampled at once, or a plane, if that is more.
constexpr std::int64_t points_together = std::int64_t{1} << 20;

/// Bytes as the character codes by which VTK writes strings in ASCII.
std::string codes_of(const std::string& text) {
  std::string out;
  for (const char c : text) out += fmt::format("{} ", static_cast<int>(static_cast<unsigned char>(c)));
  return out + "0";
}

std::string triple_text(const std::array<int, 3>& per_cell) {
  const auto one = [](int k) { return k >= 0 ? fmt::format("{}", 1 << k) : fmt::format("1/{}", 1 << -k); };
  return fmt::format("{} x {} x {} samples a cell", one(per_cell[0]), one(per_cell[1]), one(per_cell[2]));
}

std::string vti_head(const VtkBlock& b, const ExportNote& note, bool is_packed) {
  const auto& e = b.extent;
  const std::string extent = fmt::format("{} {} {} {} {} {}", e[0], e[1], e[2], e[3], e[4], e[5]);
  std::string fields;
  const auto field = [&](const char* name, double value) {
    fields += fmt::format(
        "      <DataArray type=\"Float64\" Name=\"{}\" NumberOfTuples=\"1\" "
        "format=\"ascii\">{}</DataArray>\n",
        name, value);
  };
  if (note.certified) {
    field("epsilon_abs", note.epsilon_abs);
    field("between_samples_abs", note.epsilon_abs + note.jump);
  }
  for (const auto& [name, text] :
       {std::pair{"unit", note.grid.unit}, {"content_sha256", note.content_sha256}})
    fields += fmt::format(
        "      <Array type=\"String\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}</Array>\n", name,
        codes_of(text));
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\"{}>\n  <ImageData WholeExtent=\"{}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\" "
      "Direction=\"1 0 0 0 1 0 0 0 1\">\n    <FieldData>\n{}    </FieldData>\n    <Piece Extent=\"{}\">\n"
      "      <PointData Scalars=\"density\">\n        <DataArray type=\"Float32\" Name=\"density\" "
      "format=\"appended\" offset=\"0\"/>\n      </PointData>\n    </Piece>\n  </ImageData>\n"
      "  <AppendedData encoding=\"raw\">\n_",
      is_packed ? " compressor=\"vtkZLibDataCompressor\"" : "", extent, b.origin[0], b.origin[1], b.origin[2],
      b.spacing[0], b.spacing[1], b.spacing[2], fields, extent);
}

/// The samples of a block behind its head, in the order and pieces in which they are made.
class VtiData {
 public:
  VtiData(std::ofstream& file, std::uint64_t bytes, bool is_packed) : file_(file), packed_(is_packed) {
    if (!packed_) {
      put(std::array{bytes});
      return;
    }
    const std::uint64_t blocks = (bytes + packed_block_bytes - 1) / packed_block_bytes;
    // Number of blocks, their size, that of the last where it is smaller, and the packed size of each, which
    // are known at the end.
    sizes_ = {blocks, packed_block_bytes, bytes % packed_block_bytes};
    at_ = file_.tellp();
    put(std::vector<std::uint64_t>(3 + blocks));
  }
  void add(std::span<const std::byte> bytes) {
    if (!packed_) return write(bytes);
    while (!bytes.empty()) {
      const std::size_t n = std::min<std::size_t>(packed_block_bytes - waiting_.size(), bytes.size());
      waiting_.insert(waiting_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
      bytes = bytes.subspan(n);
      if (waiting_.size() == packed_block_bytes) pack();
    }
  }
  void finish() {
    if (!packed_) return;
    if (!waiting_.empty()) pack();
    const auto end = file_.tellp();
    file_.seekp(at_);
    put(sizes_);
    file_.seekp(end);
  }

 private:
  void write(std::span<const std::byte> bytes) {
    file_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  void put(std::span<const std::uint64_t> numbers) { write(std::as_bytes(numbers)); }
  void pack() {
    const Bytes bytes = packed(waiting_, Wrapper::zlib, zlib_level);
    sizes_.push_back(bytes.size());
    write(bytes);
    waiting_.clear();
  }

  std::ofstream& file_;
  bool packed_;
  std::vector<std::uint64_t> sizes_;
  std::ofstream::pos_type at_;
  Bytes waiting_;
};

/// Its bytes.
std::uint64_t write_block(const MixedVolume& v, const VtkBlock& block, const ExportNote& note, bool is_packed,
                          const fs::path& path, const fs::path& shown) {
  const Index3 n = block.points();
  const std::int64_t plane = n[0] * n[1];
  const std::int64_t planes = std::clamp<std::int64_t>(points_together / plane, 1, n[2]);
  std::vector<float> samples(at(plane * planes));
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << vti_head(block, note, is_packed);
  VtiData data(file, static_cast<std::uint64_t>(block.point_count()) * sizeof(float), is_packed);
  for (std::int64_t z = 0; z < n[2]; z += planes) {
    throw_if_stopped();
    const std::span<float> some(samples.data(), at(plane * std::min(planes, n[2] - z)));
    vtk_block_samples(v, block, z, some);
    data.add(std::as_bytes(some));
  }
  data.finish();
  file << "\n  </AppendedData>\n</VTKFile>\n";
  const auto bytes = static_cast<std::uint64_t>(file.tellp());
  file.close();
  if (!file) throw ResourceError(fmt::format("{}: cannot be written; is the disk full?", shown.string()));
  return bytes;
}

std::string block_name(std::size_t i) { return fmt::format("block_{:05}.vti", i); }

/// Names are relative, one block of the dataset per triple.
std::string vtm_text(const std::vector<VtkBlock>& blocks, const std::string& folder) {
  std::map<std::array<int, 3>, std::vector<std::size_t>> by_triple;
  for (std::size_t i = 0; i < blocks.size(); ++i) by_triple[blocks[i].per_cell].push_back(i);
  std::string escaped;
  for (const char c : folder)
    escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"vtkMultiBlockDataSet\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n  <vtkMultiBlockDataSet>\n";
  std::size_t number = 0;
  for (const auto& [per_cell, members] : by_triple) {
    text += fmt::format("    <Block index=\"{}\" name=\"{}\">\n", number++, triple_text(per_cell));
    for (std::size_t i = 0; i < members.size(); ++i)
      text += fmt::format("      <DataSet index=\"{}\" name=\"{}\" file=\"{}/{}\"/>\n", i, members[i],
                          escaped, block_name(members[i]));
    text += "    </Block>\n";
  }
  return text + "  </vtkMultiBlockDataSet>\n</VTKFile>\n";
}

}  // namespace

std::vector<VtkBlock> vtk_blocks(const MixedVolume& v, std::size_t most_blocks) {
  for (std::size_t a = 0; a < 3; ++a) {
    int finest = 0;
    for (const LevelTriple& level : v.level) finest = std::max(finest, level[2 - a] - v.coarsening[2 - a]);
    if (v.grid.cells[a] << finest > std::numeric_limits<std::int32_t>::max())
      throw InputError(fmt::format("{} cells with {} samples each: more than a VTK extent can number",
                                   v.grid.cells[a], 1 << finest));
  }
  // From about what a file's head takes. Beyond the worth of 2^24 points every cube is as large as it may be.
  constexpr double least = 0x1p8, most = 0x1p28;
  std::vector<VtkBlock> blocks;
  for (double worth = least; worth <= most; worth *= 2) {
    throw_if_stopped();
    std::vector<VtkBlock> fewer = partition(v, worth);
    if (blocks.empty() || fewer.size() < blocks.size()) blocks = std::move(fewer);
    if (blocks.size() <= most_blocks) break;
  }
  return blocks;
}

void vtk_block_samples(const MixedVolume& v, const VtkBlock& block, std::int64_t first_plane,
                       std::span<float> out) {
  const Index3 n = block.points();
  SampleBox box;
  box.per_cell = block.per_cell;
  box.end_brick =
      v.bricks();  // a point on a far face belongs to the brick beyond it, in whatever block that lies
  for (std::size_t a = 0; a < 3; ++a) {
    box.first[a] = block.extent[2 * a];
    box.count[a] = n[a];
    box.first_brick[a] = block.first_brick[a];
  }
  box.first[2] += first_plane;
  box.count[2] = static_cast<std::int64_t>(out.size()) / (n[0] * n[1]);
  if (first_plane < 0 || first_plane + box.count[2] > n[2])
    throw InputError(
        fmt::format("planes {} to {} of a block that has {}", first_plane, first_plane + box.count[2], n[2]));
  sample_box(v, box, n[0], n[0] * n[1], out.data());
}

VtkResult write_vtk(const VdvrFile& file, const fs::path& path, const VtkOptions& options,
                    const Progress& progress) {
  const MixedVolume& v = file.volume;
  ExportNote note = note_of(file, v.grid);
  note.jump = largest_jump(v, progress);
  report(progress, "blocks", 0);
  const std::vector<VtkBlock> blocks = vtk_blocks(v, options.most_blocks);
  constexpr std::uint64_t bytes_of_brick = 16;  // of the partition
  std::int64_t most = 0;
  for (const VtkBlock& b : blocks)
    most =
        std::max(most, std::min(b.point_count(), std::max(points_together, b.points()[0] * b.points()[1])));
  require_memory_of_cores(v, static_cast<std::uint64_t>(most) * sizeof(float) + 2 * packed_block_bytes,
                          bytes_of_brick * v.level.size(), options.max_memory_bytes, path.string());
  const fs::path folder = fs::path(path).replace_extension();
  io::AtomicFolder files(folder);
  VtkResult result{blocks.size(), 0, 0, note.jump};
  for (const VtkBlock& b : blocks) result.points += static_cast<std::uint64_t>(b.point_count());
  // Large ones first, so that the cores end together.
  std::vector<std::size_t> order(blocks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return blocks[a].point_count() > blocks[b].point_count(); });
  std::atomic<std::uint64_t> points{0}, bytes{0};
  const Progress by_points = [&](const std::string& stage, double) {
    report(progress, stage, static_cast<double>(points) / static_cast<double>(result.points));
  };
  parallel_for(static_cast<std::int64_t>(order.size()), by_points, "export", [&](std::int64_t i) {
    const std::size_t n = order[at(i)];
    bytes += write_block(v, blocks[n], note, options.compression == Compression::deflate,
                         files.temporary() / block_name(n), folder / block_name(n));
    points += static_cast<std::uint64_t>(blocks[n].point_count());
  });
  files.commit();
  const std::string text = vtm_text(blocks, folder.filename().string());
  io::write_file(path, text);
  result.bytes = bytes + text.size();
  return result;
}

}  // namespace vdvr
