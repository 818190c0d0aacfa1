// Queues beside each other: their arrays, what they wait for, and gold that is measured on several at once.
#define BOOST_TEST_MODULE strands
#include <boost/test/unit_test.hpp>
#include <set>

#include "host/base/opencl/array.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/scans.hpp"

namespace vdvr {
namespace {

constexpr std::uint64_t large = std::uint64_t{40} << 20;

cl_mem buffer_of(opencl::State& state, std::uint64_t bytes) {
  const opencl::DeviceArray<std::uint8_t> array(state, bytes, "bytes");
  return array.buffer()();
}

BOOST_AUTO_TEST_CASE(what_a_strand_gives_back_no_other_one_gets) {
  Device device;
  opencl::State& state = device.state();
  for (const std::uint64_t bytes : {std::uint64_t{1000}, large}) {
    const cl_mem of_main = buffer_of(state, bytes), first = buffer_of(state.strand(0), bytes),
                 second = buffer_of(state.strand(1), bytes);
    const std::set<cl_mem> all{of_main, first, second};
    BOOST_TEST(all.size() == 3u);
    BOOST_TEST(buffer_of(state.strand(0), bytes) == first);
    BOOST_TEST(buffer_of(state.strand(1), bytes) == second);
    BOOST_TEST(buffer_of(state, bytes) == of_main);
  }
}

BOOST_AUTO_TEST_CASE(strands_share_one_limit_of_memory) {
  Device device("", large + large / 2);
  opencl::State& state = device.state();
  const std::uint64_t before = state.memory.left();
  for (int i = 0; i < 3; ++i)
    for (opencl::State* of : {&state, &state.strand(0), &state.strand(1)}) {
      const opencl::DeviceArray<std::uint8_t> array(*of, large, "bytes");
      BOOST_TEST(state.memory.left() == before - large);
      BOOST_CHECK_THROW(buffer_of(state.strand(0), large), ResourceError);
    }
  BOOST_TEST(state.memory.left() == before);
  BOOST_TEST(state.memory.peak() <= large + large / 2);  // what pools keep counts
}

BOOST_AUTO_TEST_CASE(a_strand_waits_for_what_was_enqueued_before_and_for_nothing_else) {
  Device device;
  opencl::State &state = device.state(), &strand = state.strand(0), &other = state.strand(1);
  cl::UserEvent gate(state.context);
  const std::vector<cl::Event> behind{gate};
  opencl::DeviceArray<int> array(state, 1000, "numbers");
  array.fill(1);
  state.queue.finish();
  state.queue.enqueueBarrierWithWaitList(&behind);
  array.fill(2);
  strand.wait_for(state);
  std::vector<int> values(1000, 0);
  cl::Event read, free;
  strand.queue.enqueueReadBuffer(array.buffer(), CL_FALSE, 0, 4000, values.data(), nullptr, &read);
  strand.queue.flush();
  other.queue.enqueueMarkerWithWaitList(nullptr, &free);
  free.wait();  // it comes back: nothing here is behind the gate
  BOOST_TEST(read.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() > CL_COMPLETE);
  gate.setStatus(CL_COMPLETE);
  read.wait();
  BOOST_TEST(values == std::vector<int>(1000, 2));
}

// Scattered bricks, so that there are many blocks of several sizes.
BOOST_AUTO_TEST_CASE(bricks_are_measured_to_the_bit_as_by_one_queue) {
  const ProjectionSet scan = testing::noise_scan(24, 12, 24, 7);
  attacks::Chain chain(scan);
  opencl::State& state = attacks::device().state();
  Grid grid;
  grid.cells = {24, 24, 24};
  grid.spacing = {0.5, 0.5, 0.5};
  grid.origin = {-6, -6, -6};
  GoldStream stream(state, chain.filtered, chain.sups, {grid, 2, 8, 8, Interpolation::six_taps});
  std::vector<std::uint8_t> wanted = stream.bricks_near_coverage();
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = wanted[i] && i % 7 < 2 ? 1 : 0;
  const Volume base =
      reconstruct_field(state, chain.filtered, chain.upsampler, grid, 8, Interpolation::six_taps, {});
  const DeviceField field(state, as_mixed(base, 2));
  const opencl::DeviceArray<std::uint8_t> selected(state, std::span<const std::uint8_t>(wanted), "bricks");
  const auto measured = [&](GoldStream::Batch& batch) { return batch.measure(field, 1e-3f, selected); };
  std::vector<BrickMeasure> by_one, by_many;
  std::size_t parts = 0;
  const auto add = [](std::vector<BrickMeasure>& to, const std::vector<BrickMeasure>& found) {
    to.insert(to.end(), found.begin(), found.end());
  };
  stream.run(
      wanted, [&](GoldStream::Batch& batch) { add(by_one, measured(batch)); }, {}, "one");
  stream.run_in_strands(
      wanted,
      [&](GoldStream::Batch& batch) -> Take {
        return [&, found = measured(batch)] {
          ++parts;
          add(by_many, found);
        };
      },
      {}, "many");
  BOOST_TEST(parts > 10u);
  BOOST_REQUIRE(by_one.size() == by_many.size());
  for (std::size_t i = 0; i < by_one.size(); ++i) {
    const BrickMeasure &a = by_one[i], &b = by_many[i];
    BOOST_TEST((a.brick == b.brick && a.total == b.total && a.error == b.error && a.slack == b.slack &&
                a.passed == b.passed && a.violated == b.violated));
  }
}

// What is kept is made between the look at what is left and the batches: these get what is left then.
BOOST_AUTO_TEST_CASE(passes_end_or_say_what_lacks_whatever_memory_is_left) {
  const ProjectionSet scan = testing::noise_scan(24, 12, 24, 7);
  Grid grid;
  grid.cells = {24, 24, 24};
  grid.spacing = {0.5, 0.5, 0.5};
  grid.origin = {-6, -6, -6};
  int ended = 0, lacked = 0;
  for (std::uint64_t left = std::uint64_t{4} << 20; left < std::uint64_t{400} << 20; left += left / 3) {
    Device device("", std::uint64_t{1} << 30);
    opencl::State& state = device.state();
    const FilteredScan filtered = filter_scan(state, scan, {});
    Upsampler upsampler(state, filtered);
    const FieldSups sups = field_sups(state, upsampler, filtered, 1);
    GoldStream stream(state, filtered, sups, {grid, 2, 8, 8, Interpolation::six_taps});
    const std::vector<std::uint8_t> wanted = stream.bricks_near_coverage();
    const opencl::DeviceArray<std::uint8_t> taken(state, state.memory.left() - left, "what others hold");
    std::size_t bricks = 0;
    try {
      stream.run_in_strands(
          wanted,
          [&](GoldStream::Batch& batch) -> Take {
            return [&bricks, n = batch.bricks().size()] { bricks += n; };
          },
          {}, "pass");
      BOOST_TEST(bricks == static_cast<std::size_t>(std::ranges::count(wanted, 1)));
      ++ended;
    } catch (const ResourceError&) {
      ++lacked;
    }
  }
  BOOST_TEST(ended > 0);
  BOOST_TEST(lacked > 0);
}

}  // namespace
}  // namespace vdvr
