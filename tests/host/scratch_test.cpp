#define BOOST_TEST_MODULE scratch
#include "vdvr/expert/scratch.hpp"

#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "vdvr/error.hpp"
#include "vdvr/expert/sample_array.hpp"

using namespace vdvr;

namespace {

constexpr std::uint64_t mebibyte = std::uint64_t{1} << 20;

// A disk, which a temporary folder need not be.
std::shared_ptr<Scratch> scratch_here(std::uint64_t resident) {
  return std::make_shared<Scratch>(".", resident);
}

// Of what lies in files, libraries included.
std::uint64_t resident_file_bytes() {
  std::ifstream in("/proc/self/status");
  for (std::string name; in >> name;) {
    std::uint64_t kibi = 0;
    if (name == "RssFile:" && in >> kibi) return kibi * 1024;
    std::getline(in, name);
  }
  return 0;
}

}  // namespace

BOOST_AUTO_TEST_CASE(array_in_scratch_is_zero_and_keeps_what_is_written) {
  const auto scratch = scratch_here(mebibyte);
  SampleArray a(3'000'000, scratch, "test");
  BOOST_TEST(std::all_of(a.begin(), a.end(), [](float v) { return v == 0; }));
  for (std::size_t i = 0; i < a.size(); ++i) a[i] = static_cast<float>(i % 1021);
  bool same = true;
  for (std::size_t i = 0; i < a.size(); ++i) same = same && a[i] == static_cast<float>(i % 1021);
  BOOST_TEST(same);
  BOOST_TEST(a.resident_bytes() == mebibyte);
  BOOST_TEST(scratch->peak_bytes() == 12'000'000u);
}

BOOST_AUTO_TEST_CASE(copies_and_moves_of_arrays_keep_their_samples) {
  SampleArray in_file(5, scratch_here(mebibyte), "test"), in_memory{1, 2, 3};
  in_file[4] = 7;
  SampleArray copy = in_file;
  copy[0] = 1;
  BOOST_TEST(static_cast<bool>(copy.scratch()));
  BOOST_TEST(in_file[0] == 0.0f);
  BOOST_TEST(copy[4] == 7.0f);
  SampleArray moved = std::move(copy);
  BOOST_TEST(moved[0] == 1.0f);
  moved = in_memory;
  BOOST_TEST((moved == SampleArray{1, 2, 3}));
  in_memory = std::move(in_file);
  BOOST_TEST(in_memory.size() == 5u);
  in_memory.resize(6);
  BOOST_TEST(!in_memory.scratch());
  BOOST_TEST(in_memory[4] == 7.0f);
  BOOST_TEST(in_memory[5] == 0.0f);
}

BOOST_AUTO_TEST_CASE(resident_pages_of_scratch_are_let_go) {
  constexpr std::uint64_t limit = 16 * mebibyte, all = 256 * mebibyte;
  const auto scratch = scratch_here(limit);
  SampleArray a(all / sizeof(float), scratch, "test");
  const std::uint64_t before = resident_file_bytes();
  for (std::size_t i = 0; i < a.size(); i += 1024) a[i] = 1;
  // Nothing touches it any more: the next look, within milliseconds, finds too much and lets go of it.
  for (int waits = 0; waits < 1000 && resident_file_bytes() > before + limit; ++waits)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  BOOST_TEST(resident_file_bytes() <= before + limit);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); i += 1024) sum += static_cast<double>(a[i]);
  BOOST_TEST(sum == static_cast<double>(all / 4096));
}

BOOST_AUTO_TEST_CASE(files_of_scratch_have_no_name) {
  const SampleArray a(1000, scratch_here(mebibyte), "test");
  for (const auto& entry : std::filesystem::directory_iterator("."))
    BOOST_TEST(entry.path().filename().string().rfind(".vdvr-scratch", 0) != 0);
}

BOOST_AUTO_TEST_CASE(disk_that_is_too_small_is_refused_with_what_would_do) {
  const std::uint64_t free = std::filesystem::space(".").available;
  try {
    const SampleArray a((free + 1024 * mebibyte) / sizeof(float), scratch_here(mebibyte), "the projections");
    BOOST_TEST(false, "made");
  } catch (const ResourceError& e) {
    const std::string message = e.what();
    for (const char* part : {".:", "the projections", "MiB are free", "`scratch`", "`max_memory`"})
      BOOST_TEST(message.find(part) != std::string::npos, part << " in: " << message);
  }
  BOOST_CHECK_THROW(SampleArray(10, std::make_shared<Scratch>("no/such/folder", mebibyte), "x"),
                    ResourceError);
}

BOOST_AUTO_TEST_CASE(scratch_is_for_what_takes_more_than_an_eighth_of_the_limit) {
  BOOST_TEST(!scratch_for(mebibyte, 0, "."));
  BOOST_TEST(!scratch_for(mebibyte, 8 * mebibyte, "."));
  const auto made = scratch_for(mebibyte + 4, 8 * mebibyte, ".");
  BOOST_REQUIRE(static_cast<bool>(made));
  BOOST_TEST(made->resident_bytes() == mebibyte);
}

BOOST_AUTO_TEST_CASE(half_of_the_free_memory_is_some_of_it) {
  BOOST_TEST(half_of_free_memory() > 0u);
  std::ifstream in("/proc/meminfo");
  std::string name;
  std::uint64_t kibi = 0;
  in >> name >> kibi;  // MemTotal
  BOOST_TEST(half_of_free_memory() <= kibi * 512);
}

// A wide detector of few rows: a small scan, a large volume.
BOOST_AUTO_TEST_CASE(scan_lies_in_scratch_where_its_volume_takes_more_than_a_sixteenth) {
  constexpr std::int64_t rows = 40, columns = 384;
  constexpr std::uint64_t volume = 4 * columns * columns * rows;
  BOOST_TEST(!scratch_for_scan(60, rows, columns, 0, {}));
  BOOST_TEST(!scratch_for_scan(60, rows, columns, 16 * volume, {}));
  BOOST_TEST(static_cast<bool>(scratch_for_scan(60, rows, columns, 16 * volume - 16, {})));
  // Of many views it is the scan that counts, by an eighth.
  constexpr std::uint64_t scan = 3 * volume;
  BOOST_TEST(!scratch_for_scan(3 * columns, rows, columns, 8 * scan, {}));
  BOOST_TEST(static_cast<bool>(scratch_for_scan(3 * columns, rows, columns, 8 * scan - 8, {})));
}
