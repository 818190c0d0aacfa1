// A build that was interrupted and resumed is the one that was not, to the bit; a journal of another build is
// refused.
#define BOOST_TEST_MODULE build_resume
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <filesystem>
#include <set>
#include <string>

#include "tests/support/scans.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;
using vdvr::testing::grid_of;
using vdvr::testing::noise_scan;
using vdvr::testing::simulated;

// Memory is little, and the grid more than a block wide, so that there are several batches; closing makes
// bricks rise.
BOOST_AUTO_TEST_CASE(build_interrupted_anywhere_and_resumed_is_the_uninterrupted_one) {
  const ProjectionSet scan = simulated(shepp_logan(8), 17, 13, 24);
  const Grid grid = grid_of(scan, {17, 17, 12}, 1.0);
  Device device("", 96 << 20);
  PlanSettings sampled;
  sampled.comparison.coefficients = Coefficients::sampled;
  sampled.granularity = 2;
  const Plan plan = make_plan(device, scan, grid, {}, {8, Interpolation::linear, 8}, {0.1, {}}, sampled);
  BuildOptions options;
  options.storage = StorageChoice::f32;
  const BuildResult whole = build(device, scan, plan, options);
  const support::TemporaryFolder folder;
  int reports = 0;
  const auto build_until = [&](int last, bool resume) {
    Journal journal(folder / "o.journal", resume);
    options.journal = &journal;
    reports = 0;
    std::set<std::string> stages;
    const BuildResult result = build(device, scan, plan, options, [&](const std::string& stage, double) {
      stages.insert(stage);
      if (++reports == last) throw Interrupted(130);
    });
    BOOST_TEST(stages.contains("repair"));
    BOOST_TEST(content_sha256(result.volume) == content_sha256(whole.volume));
    BOOST_TEST(to_json(result.certificate) == to_json(whole.certificate));
    return journal.replayed();
  };
  BOOST_TEST(build_until(0, false) == 0);
  const int all = reports;
  std::filesystem::remove(folder / "o.journal");
  std::int64_t most = 0;
  for (int n = 1; n <= all; ++n) {
    BOOST_CHECK_THROW(build_until(n, false), Interrupted);
    most = std::max(most, build_until(0, true));
    BOOST_TEST(build_until(0, true) >= most);  // all of it is in the journal now
  }
  BOOST_TEST(most > 4);
  // Interrupted again and again, it gets there all the same.
  std::filesystem::remove(folder / "o.journal");
  bool done = false;
  for (int n = 1; !done && n <= all; ++n) try {
      build_until(n, true);
      done = true;
    } catch (const Interrupted&) {
    }
  build_until(0, true);
}

BOOST_AUTO_TEST_CASE(journal_of_another_build_is_refused_with_what_differs) {
  const ProjectionSet scan = noise_scan(13, 5, 25);
  Device device;
  const Grid grid = grid_of(scan, {8, 8, 4}, 1.0);
  const support::TemporaryFolder folder;
  const auto build_with = [&](const ProjectionSet& of, double epsilon, Closing closing) {
    PlanSettings settings;
    settings.comparison.closing = closing;
    const Plan plan = make_plan(device, of, grid, {}, {8, Interpolation::linear, 8}, {epsilon, {}}, settings);
    Journal journal(folder / "o.journal", true);
    BuildOptions options;
    options.journal = &journal;
    build(device, of, plan, options);
  };
  const auto refused_for = [](const std::string& name) {
    return [name](const InputError& e) { return std::string(e.what()).find(name) != std::string::npos; };
  };
  build_with(scan, 0.3, Closing::coarse);
  BOOST_CHECK_EXCEPTION(build_with(scan, 0.31, Closing::coarse), InputError, refused_for("epsilon was"));
  BOOST_CHECK_EXCEPTION(build_with(scan, 0.3, Closing::none), InputError,
                        refused_for("closing was coarse, is none"));
  BOOST_CHECK_EXCEPTION(build_with(noise_scan(13, 5, 25, 9), 0.3, Closing::coarse), InputError,
                        refused_for("plan was"));
  build_with(scan, 0.3, Closing::coarse);
}
