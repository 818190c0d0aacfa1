// Frames that a child process reads for us: the numbers, and every way in which it can end.
#define BOOST_TEST_MODULE read_in_child
#include "host/base/system/read_in_child.hpp"

#include <unistd.h>

#include <boost/test/unit_test.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "vdvr/error.hpp"

using namespace vdvr;
using io::FrameBlock, io::FrameReader;

namespace {

constexpr std::int64_t numbers = 6;  // of a frame

double value(std::int64_t stack, std::int64_t frame, std::int64_t i) {
  return static_cast<double>(1000 * stack + 10 * frame + i) + 1.0 / 3;
}

void fill(const FrameBlock& block, double* out) {
  for (std::int64_t k = 0; k < block.frames; ++k)
    for (std::int64_t i = 0; i < numbers; ++i) *out++ = value(block.stack, block.first + k, i);
}

FrameReader reader_of(FrameReader::Read read, std::uint64_t frames_at_once = 3,
                      std::uint64_t max_memory_bytes = 0) {
  return {"scan.h5",      max_memory_bytes, 0, numbers, frames_at_once * numbers * sizeof(double),
          std::move(read)};
}

std::vector<double> frames_of(FrameReader& reader, FrameBlock block) {
  std::vector<double> out(static_cast<std::size_t>(block.frames * numbers), -1);
  reader.read(block, out.data());
  return out;
}

// What reading frame 4 throws, after frame 1 was read well; each later block fails with the same words.
template <typename Thrown>
std::string failure_of(const FrameReader::Read& fail) {
  FrameReader reader = reader_of([&](const FrameBlock& block, double* out) {
    if (block.first == 4) fail(block, out);
    fill(block, out);
  });
  BOOST_TEST(frames_of(reader, {0, 1, 1})[0] == value(0, 1, 0));
  std::vector<std::string> said;
  for (const std::int64_t frame : {4, 1}) try {
      frames_of(reader, {0, frame, 1});
      BOOST_ERROR("frame " << frame << " was read");
    } catch (const Thrown& e) {
      said.emplace_back(e.what());
    }
  BOOST_REQUIRE(said.size() == 2);
  BOOST_TEST(said[0] == said[1]);
  return said[0];
}

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

BOOST_AUTO_TEST_CASE(frames_come_as_they_are_read_whatever_fits_at_once) {
  for (const std::uint64_t at_once : {0, 1, 3, 100}) {
    FrameReader reader = reader_of(fill, at_once);
    for (const FrameBlock block : {FrameBlock{0, 0, 7}, FrameBlock{2, 5, 1}, FrameBlock{1, 2, 6}}) {
      const std::vector<double> found = frames_of(reader, block);
      for (std::int64_t k = 0; k < block.frames; ++k)
        for (std::int64_t i = 0; i < numbers; ++i)
          BOOST_TEST(found[static_cast<std::size_t>(k * numbers + i)] ==
                     value(block.stack, block.first + k, i));
    }
  }
}

BOOST_AUTO_TEST_CASE(another_process_reads) {
  FrameReader reader = reader_of([](const FrameBlock&, double* out) { *out = ::getpid(); });
  const double who = frames_of(reader, {0, 0, 1})[0];
  BOOST_TEST(who != ::getpid());
  BOOST_TEST(frames_of(reader, {0, 1, 1})[0] == who);
}

BOOST_AUTO_TEST_CASE(what_the_reading_throws_comes_out) {
  BOOST_TEST(failure_of<FileError>([](const FrameBlock&, double*) {
               throw FileError("scan.h5: a chunk is short");
             }) == "scan.h5: a chunk is short");
  BOOST_TEST(failure_of<ResourceError>([](const FrameBlock&, double*) {
               throw ResourceError("scan.h5: too large");
             }) == "scan.h5: too large");
  BOOST_TEST(holds(failure_of<ResourceError>([](const FrameBlock&, double*) { throw std::bad_alloc(); }),
                   "not enough memory"));
  BOOST_TEST(holds(
      failure_of<FileError>([](const FrameBlock&, double*) { throw std::runtime_error("out of sorts"); }),
      "out of sorts"));
}

BOOST_AUTO_TEST_CASE(a_crash_and_a_loop_are_errors_of_the_file) {
  BOOST_TEST(holds(failure_of<FileError>([](const FrameBlock&, double*) { ::raise(SIGKILL); }),
                   "does not come to an end"));
  BOOST_TEST(holds(failure_of<FileError>([](const FrameBlock&, double*) {
                     std::signal(SIGSEGV, SIG_DFL);
                     ::raise(SIGSEGV);
                   }),
                   "the HDF5 library crashes reading it"));
  // Each block has its own time: four seconds of the processor for a file of no length.
  BOOST_TEST(holds(failure_of<FileError>([](const FrameBlock&, double*) {
                     for (volatile bool turn = true; turn;) {
                     }
                   }),
                   "does not come to an end"));
}

BOOST_AUTO_TEST_CASE(a_child_that_was_told_to_stop_stops_us) {
  BOOST_TEST(failure_of<Interrupted>([](const FrameBlock&, double*) { ::raise(SIGINT); }) == "interrupted");
}

BOOST_AUTO_TEST_CASE(the_child_goes_with_its_reader) {
  pid_t child = 0;
  {
    FrameReader reader = reader_of([](const FrameBlock&, double* out) { *out = ::getpid(); });
    child = static_cast<pid_t>(frames_of(reader, {0, 0, 1})[0]);
    BOOST_TEST(::kill(child, 0) == 0);
  }
  BOOST_TEST(::kill(child, 0) != 0);
}
