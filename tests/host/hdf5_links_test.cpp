#define BOOST_TEST_MODULE hdf5_links
#include <boost/test/unit_test.hpp>

#include "tests/support/hdf5_sources.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/volume_file.hpp"

// Scans in several HDF5 files: what is read, what is hashed, what is refused. The files of other writers are
// those of tests/program/hdf5_files.py.
namespace {

using namespace vdvr;
using namespace vdvr::support;
namespace fs = std::filesystem;

ScanOptions following() {
  ScanOptions options;
  options.follow_links = true;
  return options;
}

std::string line_of(const fs::path& file, const std::string& name) {
  return sha256_of_file(file) + " " + name + "\n";
}

// As docs/inputs.md has it: the lines sorted as bytes.
std::string hash_of_lines(std::vector<std::string> lines) {
  std::sort(lines.begin(), lines.end());
  std::string text;
  for (const auto& line : lines) text += line;
  return sha256_of_text(text);
}

BOOST_AUTO_TEST_CASE(virtual_datasets_are_read_and_every_source_is_hashed) {
  const TemporaryFolder folder;
  const ProjectionSet scan = read_scan(write_virtual_exchange(folder / "a.h5"));
  check_samples(scan);
  BOOST_TEST(scan.report.sha256 ==
             hash_of_lines({line_of(folder / "a.h5", "a.h5"), line_of(folder / "part0.h5", "part0.h5"),
                            line_of(folder / "part1.h5", "part1.h5")}));
}

BOOST_AUTO_TEST_CASE(files_that_are_linked_but_not_used_are_not_hashed) {
  const TemporaryFolder folder;
  write_exchange(folder / "a.h5", {});
  write_exchange(folder / "other.h5", {});
  {
    const hid_t file = H5Fopen((folder / "a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    link_external(file, "/other", "other.h5", "/");
    link_external(file, "/gone", "gone.h5", "/");
    H5Fclose(file);
  }
  BOOST_TEST(read_scan(folder / "a.h5").report.sha256 == sha256_of_file(folder / "a.h5"));
}

BOOST_AUTO_TEST_CASE(external_links_are_read_below_the_folder_and_elsewhere_only_when_asked) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "scan/below");
  write_exchange(folder / "scan/below/a.h5", {});
  write_exchange(folder / "away.h5", {});
  const auto linking = [&](const char* name, const std::string& to) {
    Hdf5Writer file(folder / name);
    link_external(file.id(), "/exchange", to, "/exchange");
    return folder / name;
  };
  const fs::path in = linking("scan/in.h5", "below/a.h5");
  check_samples(read_scan(in));
  BOOST_TEST(read_scan(in).report.sha256 ==
             hash_of_lines({line_of(in, "in.h5"), line_of(folder / "scan/below/a.h5", "below/a.h5")}));
  fs::create_symlink(folder / "away.h5", folder / "scan/link.h5");
  const std::string absolute = (folder / "away.h5").string();
  for (const std::string& to : {std::string("../away.h5"), absolute, std::string("link.h5")}) {
    const fs::path out = linking("scan/out.h5", to);
    BOOST_TEST(has(refusal(out), "outside the scan's folder"));
    const ProjectionSet scan = read_scan(out, following());
    check_samples(scan);
    // A symbolic link bears the name that it has in the folder; what lies outside the one that the file
    // states.
    BOOST_TEST(scan.report.sha256 ==
               hash_of_lines({line_of(out, "out.h5"), line_of(folder / "away.h5", to)}));
  }
  // A link within the folder has its own name too, whichever way the folder is written.
  fs::create_symlink("below/a.h5", folder / "scan/alias.h5");
  const fs::path alias = linking("scan/by-alias.h5", "alias.h5");
  for (const fs::path& written : {alias, folder / "scan/./by-alias.h5", folder / "scan/below/../by-alias.h5"})
    BOOST_TEST(
        read_scan(written).report.sha256 ==
        hash_of_lines({line_of(alias, "by-alias.h5"), line_of(folder / "scan/below/a.h5", "alias.h5")}));
  // A stale absolute path: HDF5 looks for the name beside the file, and so does this reader.
  check_samples(read_scan(linking("scan/below/stale.h5", "/no/such/folder/a.h5")));
}

BOOST_AUTO_TEST_CASE(missing_sources_gaps_and_circles_are_named) {
  const TemporaryFolder folder;
  const fs::path path = write_virtual_exchange(folder / "a.h5");
  fs::remove(folder / "part1.h5");
  BOOST_TEST(has(refusal(path), "mapping 2 of 2: file 'part1.h5' is missing"));
  write_part(folder / "part1.h5", 1, 2);
  BOOST_TEST(has(refusal(path), "[2, 2, 3]"));
  const auto refused = [&](const std::vector<Part>& parts, hid_t type, hsize_t first) {
    Hdf5Writer file(folder / "b.h5");
    write_exchange_rest(file);
    write_virtual(file.id(), "/exchange/data", {K, V, U}, parts, type, first);
    return folder / "b.h5";
  };
  write_part(folder / "part1.h5", 1, K - 1);
  const Part whole{"part1.h5", "/entry/data", K - 1};
  BOOST_TEST(has(refusal(refused({whole}, H5T_IEEE_F32LE, 1)),
                 "6 of its 24 elements have no source, from [0, 0, 0]"));
  BOOST_TEST(has(refusal(refused({whole}, H5T_IEEE_F32LE, 0)), "from [3, 0, 0]"));
  const Part zero{"part0.h5", "/entry/data", 1};
  BOOST_TEST(has(refusal(refused({zero, whole}, H5T_IEEE_F64LE, 0)),
                 "a 4-byte float, the virtual dataset a 8-byte"));
  BOOST_TEST(refusal(refused({zero, whole}, H5T_IEEE_F32BE, 0)) == "accepted");  // only the order of bytes
  BOOST_TEST(has(refusal(refused({{".", "/exchange/data", K}}, H5T_IEEE_F32LE, 0)), "circle"));
  BOOST_TEST(has(refusal(refused({{"b.h5", "/exchange/data", K}}, H5T_IEEE_F32LE, 0)), "circle"));
  BOOST_TEST(has(refusal(refused({{"part1.h5", "/entry/other", K}}, H5T_IEEE_F32LE, 0)),
                 "has no dataset '/entry/other'"));
}

BOOST_AUTO_TEST_CASE(zstd_is_read_and_a_frame_states_what_its_chunk_needs) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.h5");
    write_exchange_rest(file);
    BOOST_REQUIRE(
        write_filtered(file.id(), "/exchange/data", {K, V, U}, raw_counts(), io::hdf5::zstd_filter_number));
  }
  check_samples(read_scan(folder / "a.h5"));
  // The frames of chunks of four frames, told to be of one.
  const hid_t file = H5Fopen((folder / "a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, "/exchange/data", H5P_DEFAULT);
  const std::string longer("\x28\xb5\x2f\xfd\x20\x60\x03\x03\x00\x00", 10);  // 96 bytes: a run, RFC 8878
  const hsize_t at[3] = {1, 0, 0};
  H5Dwrite_chunk(set, H5P_DEFAULT, 0, at, longer.size(), longer.data());
  H5Dclose(set);
  H5Fclose(file);
  BOOST_TEST(
      has(refusal(folder / "a.h5"), "chunk at [1, 0, 0] claims to unpack to 96 bytes, its shape needs 24"));
}

BOOST_AUTO_TEST_CASE(chunks_that_were_never_written_are_refused_in_scans_and_filled_in_volumes) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.h5");
    write_exchange_rest(file);
    const Shape shape{K, V, U}, chunk{1, V, U};
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(3, shape.data(), nullptr);
    H5Pset_chunk(creation, 3, chunk.data());
    const hid_t set =
        H5Dcreate2(file.id(), "/exchange/data", H5T_IEEE_F32LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    const std::vector<float> frame(V * U, 7);
    const hsize_t at[3] = {0, 0, 0};
    H5Dwrite_chunk(set, H5P_DEFAULT, 0, at, frame.size() * sizeof(float), frame.data());
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(creation);
  }
  BOOST_TEST(has(refusal(folder / "a.h5"), "chunk at [1, 0, 0] was never written"));
  const Volume volume = read_volume(folder.path().string() + "/a.h5:/exchange/data");
  BOOST_TEST(volume.samples.front() == 7);
  BOOST_TEST(volume.samples.back() == 0);
}

}  // namespace
