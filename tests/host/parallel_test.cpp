#define BOOST_TEST_MODULE parallel
#include "host/base/system/parallel.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <fstream>
#include <numeric>
#include <stdexcept>

#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t n = 1000;

// How often each index was taken.
std::vector<int> taken(const Progress& progress = {}) {
  std::vector<int> count(n);
  parallel_for(n, progress, "stage", [&](std::int64_t i) { ++count[static_cast<std::size_t>(i)]; });
  return count;
}

}  // namespace

// The first case: later the C library keeps the stacks of ended threads for new ones.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // their shadows need the address space
BOOST_AUTO_TEST_CASE(without_a_thread_to_be_had_the_caller_does_it_all) {
  const pid_t child = ::fork();
  if (child == 0) {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t now = pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
    const rlimit space{now + (1 << 20), RLIM_INFINITY};  // a thread's stack takes more
    ::setrlimit(RLIMIT_AS, &space);
    bool refused = false;
    try {
      std::thread([] {}).join();
    } catch (const std::system_error&) {
      refused = true;
    }
    std::vector<int> in_order;
    in_strands(n, 2, [&](std::size_t, std::int64_t i) -> Take {
      return [&in_order, i] { in_order.push_back(static_cast<int>(i)); };
    });
    const bool all =
        taken() == std::vector<int>(n, 1) && std::ssize(in_order) == n && std::ranges::is_sorted(in_order);
    ::_exit(refused && all ? 0 : refused ? 1 : 2);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  BOOST_TEST(WIFEXITED(status));
  BOOST_TEST(WEXITSTATUS(status) == 0);  // 1: work was lost; 2: there was a thread after all
}
#endif

BOOST_AUTO_TEST_CASE(every_index_is_taken_once) {
  BOOST_TEST(taken() == std::vector<int>(n, 1), boost::test_tools::per_element());
  parallel_for(0, {}, "", [](std::int64_t) { BOOST_ERROR("there is no index"); });
}

BOOST_AUTO_TEST_CASE(progress_is_called_from_the_calling_thread_and_never_goes_back) {
  const auto caller = std::this_thread::get_id();
  double last = 0;
  taken([&](const std::string& stage, double share) {
    BOOST_TEST(stage == "stage");
    BOOST_REQUIRE((std::this_thread::get_id() == caller));
    BOOST_TEST(share >= last);
    BOOST_TEST(share <= 1);
    last = share;
  });
}

BOOST_AUTO_TEST_CASE(an_exception_of_any_thread_ends_the_loop_and_comes_out) {
  std::atomic<std::int64_t> done{0};
  BOOST_CHECK_THROW(parallel_for(n, {}, "",
                                 [&](std::int64_t i) {
                                   if (i == n / 2) throw std::domain_error("here");
                                   ++done;
                                 }),
                    std::domain_error);
  BOOST_TEST(done < n);
}

BOOST_AUTO_TEST_CASE(an_exception_of_progress_ends_the_loop_and_comes_out) {
  const auto caller = std::this_thread::get_id();
  std::atomic<bool> begun{false};
  const auto body = [&](std::int64_t) {  // the others leave the caller an index, or it has nothing to report
    if (std::this_thread::get_id() == caller) begun = true;
    while (!begun) std::this_thread::yield();
  };
  BOOST_CHECK_THROW(parallel_for(
                        n, [](auto&&...) { throw std::range_error("stop"); }, "", body),
                    std::range_error);
}

BOOST_AUTO_TEST_CASE(a_requested_stop_ends_loops_that_report_nothing) {
  std::atomic<std::int64_t> done{0};
  BOOST_CHECK_EXCEPTION(parallel_for(n, {}, "",
                                     [&](std::int64_t i) {
                                       if (i == n / 2) request_stop(143);
                                       ++done;
                                     }),
                        Interrupted, [](const Interrupted& e) { return e.reason() == 143; });
  BOOST_TEST(done < n);
  BOOST_CHECK_THROW(parallel_for(1, {}, "", [](std::int64_t) {}), Interrupted);
  request_stop(0);
  parallel_for(1, {}, "", [](std::int64_t) {});
}

// --- strands ---

namespace {

// What is taken, in its order; every part computes for a while that differs.
std::vector<std::int64_t> taken_of(std::int64_t parts, std::int64_t strands) {
  std::vector<std::int64_t> out;
  in_strands(parts, strands, [&](std::size_t, std::int64_t i) -> Take {
    std::this_thread::sleep_for(std::chrono::microseconds(i * 37 % 5 * 100));
    return [&out, i] { out.push_back(i); };
  });
  return out;
}

std::vector<std::int64_t> numbers(std::int64_t parts) {
  std::vector<std::int64_t> out(static_cast<std::size_t>(parts));
  std::iota(out.begin(), out.end(), 0);
  return out;
}

}  // namespace

BOOST_AUTO_TEST_CASE(what_strands_compute_is_taken_in_order) {
  for (const std::int64_t strands : {1, 2, 3, 7})
    for (const std::int64_t parts : {0, 1, 2, 60}) BOOST_TEST(taken_of(parts, strands) == numbers(parts));
}

BOOST_AUTO_TEST_CASE(a_strand_has_its_parts_and_one_at_a_time_and_is_not_far_ahead) {
  constexpr std::int64_t strands = 3, parts = 60;
  const auto caller = std::this_thread::get_id();
  std::array<std::atomic<int>, 3> within{};
  std::atomic<std::int64_t> taken_so_far{0};
  std::atomic<bool> wrong{false};
  in_strands(parts, strands, [&](std::size_t strand, std::int64_t i) -> Take {
    if (++within.at(strand) != 1 || i % strands != static_cast<std::int64_t>(strand) ||
        std::this_thread::get_id() == caller || i >= taken_so_far + 2 * strands)
      wrong = true;
    std::this_thread::yield();
    --within.at(strand);
    return [&] {
      if (std::this_thread::get_id() != caller) wrong = true;
      ++taken_so_far;
    };
  });
  BOOST_TEST(!wrong);
  BOOST_TEST(taken_so_far == parts);
}

BOOST_AUTO_TEST_CASE(strands_compute_beside_each_other) {
  std::atomic<int> here{0};
  in_strands(2, 2, [&](std::size_t, std::int64_t) -> Take {
    ++here;
    while (here < 2) std::this_thread::yield();  // for the other one
    return [] {};
  });
  BOOST_TEST(here == 2);
}

BOOST_AUTO_TEST_CASE(exceptions_of_strands_and_of_what_takes_come_out_once_all_have_ended) {
  std::atomic<int> running{0};
  const auto compute = [&](std::int64_t bad) {
    return [&running, bad](std::size_t, std::int64_t i) -> Take {
      ++running;
      std::this_thread::yield();
      --running;
      if (i == bad) throw std::domain_error("here");
      return [i] {
        if (i == 20) throw std::range_error("there");
      };
    };
  };
  for (const std::int64_t strands : {1, 2, 3}) {
    BOOST_CHECK_THROW(in_strands(n, strands, compute(10)), std::domain_error);
    BOOST_TEST(running == 0);
    BOOST_CHECK_THROW(in_strands(n, strands, compute(-1)), std::range_error);
    BOOST_TEST(running == 0);
  }
}

BOOST_AUTO_TEST_CASE(a_requested_stop_ends_strands) {
  for (const std::int64_t strands : {1, 3}) {
    std::atomic<std::int64_t> done{0};
    BOOST_CHECK_THROW(in_strands(n, strands,
                                 [&](std::size_t, std::int64_t i) -> Take {
                                   if (i == 10) request_stop(143);
                                   ++done;
                                   return [] {};
                                 }),
                      Interrupted);
    BOOST_TEST(done < n);
    request_stop(0);
  }
}
