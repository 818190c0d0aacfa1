// What export writes, held to sample_at to the bit by our own readers; VTK's blocks in memory; folders that
// appear whole. tests/program/export_readers.py has the programs that the formats are for.
#define BOOST_TEST_MODULE export_volume
#include <boost/test/unit_test.hpp>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "host/files/io/npy_file.hpp"
#include "host/volume/sampler/sample_box.hpp"
#include "tests/support/certificates.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/export_vtk.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/stop.hpp"
#include "vdvr/expert/volume_file.hpp"
#include "vdvr/export_volume.hpp"

namespace fs = std::filesystem;
using namespace vdvr;
using support::TemporaryFolder;

namespace {

const std::vector<LevelTriple> triples{{0, 0, 0}, {1, 1, 1}, {0, 2, 1}, {2, 2, 2}, {3, 0, 1}};

/// Bricks disagree on their faces, the last ones are cut by the grid, and the base is coarser along two axes.
VdvrFile hostile_file(const LevelTriple& coarsening = {1, 0, 2}) {
  VdvrFile file;
  // Positions that float32 holds, so that sample_at rounds none.
  const Grid grid{{12, 6, 10}, {-4.5, 0.25, 8}, {1, 0.5, 0.125}, "mm"};
  file.volume = support::random_mixed(grid, 4, 8, triples, 12, coarsening);
  file.certificate = support::full_certificate();
  return file;
}

ExportOptions options(ExportFormat format, int oversampling = 1) {
  ExportOptions o;
  o.format = format;
  o.oversampling = oversampling;
  return o;
}

/// The samples of a finer grid, one by one.
std::vector<float> expected(const MixedVolume& v, const Grid& grid) {
  std::vector<float> out;
  const Index3 n = grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) out.push_back(sample_at(v, grid.position({x, y, z})));
  return out;
}

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

}  // namespace

BOOST_AUTO_TEST_CASE(what_our_readers_read_back_is_the_field_to_the_bit) {
  const TemporaryFolder folder;
  for (const LevelTriple& coarsening : {LevelTriple{0, 0, 0}, LevelTriple{1, 0, 2}}) {
    const VdvrFile file = hostile_file(coarsening);
    for (const int rate : {1, 2, 8})
      for (const auto& [name, shown, format] : {std::tuple{"v.mha", "v.mha", ExportFormat::mha},
                                                {"v.nrrd", "v.nrrd", ExportFormat::nrrd},
                                                {"v.tif", "v.tif", ExportFormat::tiff},
                                                {"slices", "slices", ExportFormat::tiff},
                                                {"v.h5", "v.h5:/volume", ExportFormat::hdf5}}) {
        const ExportResult r = export_volume(file, folder / name, options(format, rate));
        const Volume back = read_volume(folder / shown);
        BOOST_TEST_CONTEXT(name << " at " << rate) {
          BOOST_TEST(back.samples == expected(file.volume, r.grid), boost::test_tools::per_element());
          BOOST_TEST(back.grid.unit == "mm");
          for (std::size_t a = 0; a < 3; ++a) BOOST_TEST(back.grid.spacing[a] == r.grid.spacing[a]);
        }
      }
  }
}

BOOST_AUTO_TEST_CASE(exported_integers_are_read_back_as_densities) {
  const TemporaryFolder folder;
  const VdvrFile file = hostile_file();
  for (const auto& [name, shown, format] : {std::tuple{"v.tif", "v.tif", ExportFormat::tiff},
                                            {"slices", "slices", ExportFormat::tiff},
                                            {"v.h5", "v.h5:/volume", ExportFormat::hdf5}}) {
    ExportOptions o = options(format, 2);
    o.samples = SampleType::u16;
    const ExportResult r = export_volume(file, folder / name, o);
    const std::vector<float> wanted = expected(file.volume, r.grid),
                             back = read_volume(folder / shown).samples;
    BOOST_REQUIRE(back.size() == wanted.size());
    // Half a step, and the rounding of the sum to float.
    const double largest = std::max(std::abs(r.offset), std::abs(r.offset + 65535 * r.scale));
    for (std::size_t i = 0; i < back.size(); ++i)
      BOOST_REQUIRE(std::abs(static_cast<double>(back[i]) - static_cast<double>(wanted[i])) <=
                    r.scale / 2 * (1 + 0x1p-40) + 0x1p-24 * largest);
  }
}

BOOST_AUTO_TEST_CASE(planes_in_any_parts_make_the_files_that_an_export_makes) {
  const TemporaryFolder folder;
  const VdvrFile file = hostile_file();
  for (const auto& [name, shown, format] : {std::tuple{"v.mha", "v.mha", ExportFormat::mha},
                                            {"v.tif", "v.tif", ExportFormat::tiff},
                                            {"slices", "slices", ExportFormat::tiff},
                                            {"v.h5", "v.h5:/volume", ExportFormat::hdf5}}) {
    const Grid& grid = file.volume.grid;
    const std::vector<float> samples = expected(file.volume, grid);
    for (const std::size_t step : {std::size_t{1}, std::size_t{1000}, samples.size()}) {
      {
        UniformWriter never(folder / name, grid, options(format));
        never.append(std::span(samples).first(samples.size() - 1));
        BOOST_CHECK_THROW(never.commit(), InputError);
      }
      BOOST_TEST(fs::is_empty(folder.path()));
      UniformWriter writer(folder / name, grid, options(format));
      for (std::size_t i = 0; i < samples.size(); i += step)
        writer.append(std::span(samples).subspan(i, std::min(step, samples.size() - i)));
      const ExportResult r = writer.commit();
      BOOST_TEST(r.samples == samples.size());
      const Volume back = read_volume(folder / shown);
      BOOST_TEST(back.samples == samples, boost::test_tools::per_element());
      BOOST_TEST(back.grid.unit == grid.unit);
      fs::remove_all(folder / name);
    }
  }
  BOOST_CHECK_THROW(UniformWriter(folder / "v.vtm", file.volume.grid, options(ExportFormat::vtm)),
                    InputError);
  ExportOptions whole = options(ExportFormat::npy);
  whole.samples = SampleType::u8;
  BOOST_CHECK_THROW(UniformWriter(folder / "v.npy", file.volume.grid, whole), InputError);
  BOOST_TEST(fs::is_empty(folder.path()));
}

BOOST_AUTO_TEST_CASE(npy_and_raw_hold_the_field_and_say_where) {
  const TemporaryFolder folder;
  const VdvrFile file = hostile_file();
  const ExportResult r = export_volume(file, folder / "v.npy", options(ExportFormat::npy, 2));
  const io::NpyArray array = io::read_npy(folder / "v.npy");
  const std::vector<float> wanted = expected(file.volume, r.grid);
  const Index3 n = r.grid.samples();
  BOOST_TEST((array.shape == std::vector<std::int64_t>{n[2], n[1], n[0]}));
  for (std::size_t i = 0; i < wanted.size(); ++i)
    BOOST_REQUIRE(array.values[i] == static_cast<double>(wanted[i]));
  ExportOptions bytes = options(ExportFormat::raw, 2);
  bytes.samples = SampleType::u8;
  const ExportResult scaled = export_volume(file, folder / "v.raw", bytes);
  const std::string stored = support::bytes_of(folder / "v.raw");
  BOOST_REQUIRE(stored.size() == wanted.size());
  // Half a step, and the rounding of value and code in double.
  const double most = scaled.scale / 2 * (1 + 0x1p-40);
  std::set<int> codes;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const int code = static_cast<unsigned char>(stored[i]);
    codes.insert(code);
    BOOST_REQUIRE(std::abs(scaled.offset + scaled.scale * code - static_cast<double>(wanted[i])) <= most);
  }
  BOOST_TEST(codes.size() > 200);
  const auto note = nlohmann::json::parse(support::bytes_of(folder / "v.raw.json"));
  BOOST_TEST(note.at("type") == "uint8");
  BOOST_TEST(note.at("scale") == scaled.scale);
  BOOST_TEST(note.at("epsilon_abs") == file.certificate.epsilon_abs);
  BOOST_TEST(note.at("shape") == (nlohmann::json{n[2], n[1], n[0]}));
  BOOST_TEST(note.at("spacing") == (nlohmann::json{0.0625, 0.25, 0.5}));
}

BOOST_AUTO_TEST_CASE(a_slab_of_any_depth_makes_the_same_file) {
  const TemporaryFolder folder;
  VdvrFile file = hostile_file();
  export_volume(file, folder / "v.raw", options(ExportFormat::raw, 8));
  // Room for the volume and a plane or two of float32.
  const std::uint64_t plane = (12 * 8 + 1) * (6 * 8 + 1) * 8;
  std::uint64_t held = file.volume.base.bytes() + file.volume.level.size() * 7;
  for (const auto& [kind, block] : file.volume.tiles) held += block.bytes();
  ExportOptions tight = options(ExportFormat::raw, 8);
  for (const std::uint64_t planes : {1, 2, 7}) {
    tight.max_memory_bytes = held + planes * plane;
    export_volume(file, folder / "tight.raw", tight);
    BOOST_TEST((support::bytes_of(folder / "tight.raw") == support::bytes_of(folder / "v.raw")));
  }
  tight.max_memory_bytes = held + plane - 1;
  BOOST_CHECK_THROW(export_volume(file, folder / "none.raw", tight), ResourceError);
  BOOST_TEST(!fs::exists(folder / "none.raw"));
  for (const auto& [name, format] :
       {std::pair{"v.zarr", ExportFormat::ome_zarr}, {"v.vtm", ExportFormat::vtm}}) {
    ExportOptions least = options(format, 2);
    least.max_memory_bytes = held + 100;
    BOOST_CHECK_THROW(export_volume(file, folder / name, least), ResourceError);
    BOOST_TEST(!fs::exists(folder / name));
  }
}

BOOST_AUTO_TEST_CASE(blocks_fill_the_grid_once_and_agree_wherever_they_meet) {
  for (const LevelTriple& coarsening : {LevelTriple{0, 0, 0}, LevelTriple{1, 0, 2}}) {
    const VdvrFile file = hostile_file(coarsening);
    const MixedVolume& v = file.volume;
    std::size_t before = 1000;
    for (const std::size_t most : {1000, 6, 1}) {
      const std::vector<VtkBlock> blocks = vtk_blocks(v, most);
      BOOST_TEST(blocks.size() <= std::max<std::size_t>(most, 1));
      BOOST_TEST(blocks.size() <= before);
      before = blocks.size();
      std::vector<int> owner(v.level.size(), 0);
      const Index3 n = v.bricks();
      std::map<std::array<double, 3>, float> at_point;
      std::int64_t met_again = 0;
      for (const VtkBlock& b : blocks) {
        for (std::int64_t z = 0; z < b.bricks[2]; ++z)
          for (std::int64_t y = 0; y < b.bricks[1]; ++y)
            for (std::int64_t x = 0; x < b.bricks[0]; ++x) {
              const auto brick = static_cast<std::size_t>(
                  ((b.first_brick[2] + z) * n[1] + b.first_brick[1] + y) * n[0] + b.first_brick[0] + x);
              ++owner[brick];
              // No brick of the block is finer than it: between its points nothing is lost.
              for (std::size_t a = 0; a < 3; ++a)
                BOOST_TEST(v.level[brick][2 - a] - v.coarsening[2 - a] <= b.per_cell[a]);
            }
        const Index3 p = b.points();
        std::vector<float> samples(static_cast<std::size_t>(b.point_count()));
        vtk_block_samples(v, b, 0, samples);
        std::size_t i = 0;
        for (std::int64_t z = 0; z < p[2]; ++z)
          for (std::int64_t y = 0; y < p[1]; ++y)
            for (std::int64_t x = 0; x < p[0]; ++x, ++i) {
              const std::array<double, 3> at{
                  b.origin[0] + static_cast<double>(b.extent[0] + x) * b.spacing[0],
                  b.origin[1] + static_cast<double>(b.extent[2] + y) * b.spacing[1],
                  b.origin[2] + static_cast<double>(b.extent[4] + z) * b.spacing[2]};
              BOOST_REQUIRE(samples[i] == sample_at(v, at));
              const auto [found, is_new] = at_point.try_emplace(at, samples[i]);
              met_again += !is_new;
              BOOST_REQUIRE(found->second == samples[i]);
            }
      }
      BOOST_TEST((blocks.size() == 1 || met_again > 0));
      BOOST_TEST(std::all_of(owner.begin(), owner.end(), [](int count) { return count == 1; }));
    }
  }
}

BOOST_AUTO_TEST_CASE(bricks_of_one_triple_are_one_block) {
  const Grid grid{{20, 9, 14}, {0, 0, 0}, {1, 1, 1}, "pixel"};
  const MixedVolume v = support::random_mixed(grid, 4, 8, {{0, 0, 0}}, 3);
  const std::vector<VtkBlock> blocks = vtk_blocks(v);
  BOOST_REQUIRE(blocks.size() == 1);
  BOOST_TEST((blocks[0].extent == std::array<std::int64_t, 6>{0, 20, 0, 9, 0, 14}));
}

BOOST_AUTO_TEST_CASE(planes_of_a_block_come_in_any_pieces) {
  const VdvrFile file = hostile_file();
  const VtkBlock b = vtk_blocks(file.volume, 1).at(0);
  const Index3 n = b.points();
  std::vector<float> whole(static_cast<std::size_t>(b.point_count()));
  vtk_block_samples(file.volume, b, 0, whole);
  std::vector<float> some(static_cast<std::size_t>(3 * n[0] * n[1]));
  vtk_block_samples(file.volume, b, 5, some);
  BOOST_TEST(std::equal(some.begin(), some.end(), whole.begin() + 5 * n[0] * n[1]));
  BOOST_CHECK_THROW(vtk_block_samples(file.volume, b, n[2] - 2, some), InputError);
}

BOOST_AUTO_TEST_CASE(the_jump_between_bricks_is_the_largest_and_none_within_a_triple) {
  // Two bricks along x: the upper one finer, with one sample of the common face off by a quarter.
  const Grid grid{{8, 4, 4}, {0, 0, 0}, {1, 1, 1}, "pixel"};
  MixedVolume v =
      support::sampled_mixed(grid, 4, 2, {{0, 0, 0}}, 1, [](double x, double, double) { return x / 8; });
  BOOST_TEST(largest_jump(v, {}) == 0);
  v.level[1] = {1, 1, 1};
  std::vector<float> tile;
  for (int i = 0; i < 9 * 9 * 9; ++i) tile.push_back(0.5f + static_cast<float>(i % 9) / 16);
  v.tiles[LevelTriple{1, 1, 1}] = tile;
  BOOST_TEST(largest_jump(v, {}) == 0);
  v.tiles[LevelTriple{1, 1, 1}].f32[9 * (9 * 3 + 5)] += 0.25f;
  BOOST_TEST(largest_jump(v, {}) == 0.25);
  VdvrFile file;
  file.volume = v;
  file.certificate = support::full_certificate();
  const TemporaryFolder folder;
  const ExportResult coarse = export_volume(file, folder / "c.raw", options(ExportFormat::raw));
  BOOST_TEST(!coarse.exact_between_samples);
  const ExportResult fine = export_volume(file, folder / "f.raw", options(ExportFormat::raw, 2));
  BOOST_TEST(fine.exact_between_samples);
  BOOST_TEST(fine.jump == 0.25);
}

BOOST_AUTO_TEST_CASE(a_folder_is_replaced_whole_and_only_where_it_holds_an_export) {
  const TemporaryFolder folder;
  const VdvrFile file = hostile_file();
  for (const auto& [name, format] :
       {std::pair{"slices", ExportFormat::tiff}, {"v.zarr", ExportFormat::ome_zarr}}) {
    BOOST_TEST_CONTEXT(name) {
      export_volume(file, folder / name, options(format, 2));
      export_volume(file, folder / name, options(format, 1));  // fewer slices, fewer levels
      const auto left = names_in(folder / name);
      BOOST_TEST(left.size() == (format == ExportFormat::tiff ? 12 : 2));
      std::ofstream(folder / name / "thesis.txt") << "mine";
      BOOST_CHECK_EXCEPTION(
          export_volume(file, folder / name, options(format, 1)), InputError,
          [](const InputError& e) { return std::string(e.what()).find("thesis.txt") != std::string::npos; });
      BOOST_TEST(support::bytes_of(folder / name / "thesis.txt") == "mine");
    }
  }
  fs::create_directories(folder / "v");
  std::ofstream(folder / "v" / "mine.txt") << "mine";
  BOOST_CHECK_THROW(export_volume(file, folder / "v.vtm", options(ExportFormat::vtm)), InputError);
  BOOST_TEST(!fs::exists(folder / "v.vtm"));
  for (const auto& name : names_in(folder.path())) BOOST_TEST(name[0] != '.');
}

BOOST_AUTO_TEST_CASE(an_export_that_is_stopped_leaves_nothing_and_keeps_what_was_there) {
  const TemporaryFolder folder;
  const VdvrFile file = hostile_file();
  for (const auto& [name, format] : {std::pair{"v.mha", ExportFormat::mha},
                                     {"v.npy", ExportFormat::npy},
                                     {"v.tif", ExportFormat::tiff},
                                     {"v.h5", ExportFormat::hdf5},
                                     {"slices", ExportFormat::tiff},
                                     {"v.zarr", ExportFormat::ome_zarr},
                                     {"v.vtm", ExportFormat::vtm}}) {
    const Progress stop = [](const std::string& stage, double) {
      if (stage == "export") throw Interrupted(1);
    };
    BOOST_CHECK_THROW(export_volume(file, folder / name, options(format), stop), Interrupted);
    BOOST_TEST(names_in(folder.path()).empty(), name << " left something");
  }
  export_volume(file, folder / "slices", options(ExportFormat::tiff));
  const auto before = names_in(folder / "slices");
  BOOST_CHECK_THROW(export_volume(file, folder / "slices", options(ExportFormat::tiff, 4),
                                  [](const std::string&, double) { throw Interrupted(1); }),
                    Interrupted);
  BOOST_TEST((names_in(folder / "slices") == before));
  BOOST_TEST(names_in(folder.path()).size() == 1);
}

BOOST_AUTO_TEST_CASE(a_program_that_ends_without_unwinding_removes_folders_too) {
  const TemporaryFolder folder;
  io::AtomicFolder half(folder / "half");
  std::ofstream(half.temporary() / "part") << "x";
  io::remove_temporaries();
  BOOST_TEST(names_in(folder.path()).empty());
}

BOOST_AUTO_TEST_CASE(options_that_do_not_fit_are_refused_before_anything_is_written) {
  const TemporaryFolder folder;
  const VdvrFile file = hostile_file();
  const auto refused = [&](ExportOptions o) {
    BOOST_CHECK_THROW(export_volume(file, folder / "v", o), InputError);
  };
  refused(options(ExportFormat::npy, 3));
  ExportOptions o = options(ExportFormat::ome_zarr);
  o.samples = SampleType::u8;
  refused(o);
  o = options(ExportFormat::npy);
  o.range = {0.0, 1.0};
  refused(o);  // spans nothing of float32
  o.samples = SampleType::u16;
  o.range = {1.0, 1.0};
  refused(o);
  VdvrFile broken = file;
  broken.volume.grid.unit = "a\"b";
  BOOST_CHECK_THROW(export_volume(broken, folder / "v.npy", options(ExportFormat::npy)), InputError);
  BOOST_TEST(names_in(folder.path()).empty());
}

BOOST_AUTO_TEST_CASE(a_comparison_is_never_called_certified) {
  const TemporaryFolder folder;
  VdvrFile file = hostile_file();
  file.certificate.comparison = true;
  export_volume(file, folder / "v.npy", options(ExportFormat::npy));
  const auto note = nlohmann::json::parse(support::bytes_of(folder / "v.npy.json"));
  BOOST_TEST(note.at("certified") == false);
  BOOST_TEST(!note.contains("epsilon_abs"));
}
