// What a user with another device gets, without one: PoCL passes for it by the layer opencl_shim.cpp. A GPU,
// to which kernels are launched with one lane, makes the volumes of a CPU; a texture unit whose weights have
// 8 bits is charged for them; cone beam needs no double precision, and devices with and without it verify
// each other's files.
#define BOOST_TEST_MODULE any_device
#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <fstream>

#include "host/volume/sampler/sampler_terms.hpp"
#include "tests/support/program.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;
using namespace vdvr::support;

namespace {

using Words = std::vector<std::string>;
using Settings = std::map<std::string, std::string>;

const Settings gpu{
    {"VDVR_SHIM_GPU", "1"}, {"VDVR_SHIM_WORK_GROUP", "256"}, {"VDVR_SHIM_COMPUTE_UNITS", "80"}};

Settings gpu_with(const char* name, const char* value) {
  Settings settings = gpu;
  settings[name] = value;
  return settings;
}

/// Scans whose bricks rise once more after closing: that is what masks of one lane decide.
struct Scan {
  std::string name, epsilon;
  Words simulated;
};
const std::vector<Scan>& scans() {
  static const std::vector<Scan> all{
      {"parallel", "10%", {"--phantom", "shepp-logan", "--detector", "33x9", "--angles", "48"}},
      {"upright", "10%", {"--phantom", "sphere", "--detector", "17x17", "--angles", "24", "--cone", "60,90"}},
      {"tilted",
       "10%",
       {"--phantom", "sphere", "--detector", "17x17", "--angles", "24", "--cone", "60,90", "--tilt", "1,2"}}};
  return all;
}

/// The scans, and files made of them.
class Files {
 public:
  Files() {
    for (const Scan& scan : scans()) {
      Words words{"simulate", "-o", path(scan)};
      words.insert(words.end(), scan.simulated.begin(), scan.simulated.end());
      run({}, words);
    }
  }
  [[nodiscard]] std::string path(const Scan& scan) const {
    return (folder_ / (scan.name == "parallel" ? scan.name + ".h5" : scan.name)).string();
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  /// On such a device; none: the test's own.
  Ended run(const Settings& settings, const Words& words) const {
    Program program(folder_.path());
    if (!settings.empty()) program.environment = settings;
    if (!settings.empty()) program.environment["LD_PRELOAD"] = VDVR_OPENCL_SHIM;
    const Ended ended = program.run(words);
    BOOST_TEST(ended.code == 0, words[0] << " " << words.back() << ": " << ended.out << ended.err);
    return ended;
  }
  /// Built once.
  const VdvrFile& build(const Settings& settings, const Scan& scan, const std::string& name) {
    const auto [known, fresh] = built_.try_emplace(name);
    if (fresh) {
      run(settings, {"build", path(scan), "--epsilon", scan.epsilon, "-o", at(name)});
      known->second = read_vdvr(at(name));
    }
    return known->second;
  }
  Ended verify(const Settings& settings, const Scan& scan, const std::string& name) const {
    return run(settings, {"verify", at(name), "--projections", path(scan)});
  }

 private:
  TemporaryFolder folder_;
  std::map<std::string, VdvrFile> built_;
};

Files& files() {
  static Files one;
  return one;
}

std::string of(const Certificate& c) { return c.device + " " + c.driver; }

}  // namespace

BOOST_AUTO_TEST_CASE(a_gpu_makes_the_volumes_of_a_cpu) {
  for (const Scan& scan : scans()) {
    const VdvrFile &on_cpu = files().build({}, scan, scan.name + "-cpu.vdvr"),
                   &on_gpu = files().build(gpu, scan, scan.name + "-gpu.vdvr");
    BOOST_TEST(of(on_cpu.certificate) != of(on_gpu.certificate));
    BOOST_TEST(content_sha256(on_gpu.volume) == content_sha256(on_cpu.volume), scan.name);
  }
}

// Of the small arrays of a launch none is waited for, and none has a buffer of its own: there were more
// writes that block, and more buffers, than launches. What is left is made once, whatever is launched (259
// writes and 278 buffers, of 451 launches), and gold takes two launches. At a tolerance at which most
// launches are of levels: one of those has three small arrays.
BOOST_AUTO_TEST_CASE(a_build_waits_for_few_writes_and_makes_few_buffers) {
  Settings counted = gpu;
  counted["VDVR_SHIM_CALLS"] = files().at("calls");
  Scan scan = scans()[0];
  scan.epsilon = "1%";
  files().build(counted, scan, "counted.vdvr");
  std::ifstream in(files().at("calls"));
  double launches = 0, blocking = 0, buffers = 0;
  for (double l = 0, w = 0, b = 0; in >> l >> w >> b;) {
    launches += l;
    blocking += w;
    buffers += b;
  }
  BOOST_TEST_MESSAGE(launches << " launches, " << blocking << " writes that block, " << buffers
                              << " buffers");
  BOOST_TEST(launches > 100);
  BOOST_TEST(blocking < 0.7 * launches);
  BOOST_TEST(buffers < 0.75 * launches);
}

BOOST_AUTO_TEST_CASE(a_texture_unit_of_8_bits_is_charged_for_them) {
  const Scan& scan = scans()[0];
  const Settings unit = gpu_with("VDVR_SHIM_FILTER_BITS", "8");
  const VdvrFile& file = files().build(unit, scan, "8-bits.vdvr");
  const Certificate& c = file.certificate;
  BOOST_TEST(c.holds_buffer);
  BOOST_TEST(c.holds_image3d.value_or(false));
  BOOST_REQUIRE(c.budget.sampler.image3d.has_value());
  // A rounded weight errs by half of 2^-8, along each axis, which each brick is charged at least for its
  // largest step.
  const FieldSlopes slopes = field_slopes(file.volume);
  double largest = 0;
  for (std::size_t i = 0; i < slopes.bricks.size(); ++i) {
    const auto& steps = slopes.bricks[i].per_sample;
    if (const auto total = static_cast<double>(c.brick_totals[i]); total >= 0)
      largest = std::max(largest, total + 0x1p-9 * std::max({steps[0], steps[1], steps[2]}));
  }
  BOOST_TEST(largest > 1.001 * c.measured_total);
  BOOST_TEST(*c.total_image3d >= largest + c.budget.arithmetic.value);
  files().verify(unit, scan, "8-bits.vdvr");
  for (const char* sampler : {"buffer", "image3d"})
    files().run(unit, {"render", files().at("8-bits.vdvr"), "--size", "64x64", "--sampler", sampler, "-o",
                       files().at(std::string(sampler) + ".png")});
}

BOOST_AUTO_TEST_CASE(devices_with_and_without_double_precision_verify_each_others_files) {
  const Settings single = gpu_with("VDVR_SHIM_FP64", "0");
  for (const Scan& scan : scans()) {
    const std::string here = scan.name + "-cpu.vdvr", there = scan.name + "-single.vdvr";
    const Certificate &in_double = files().build({}, scan, here).certificate,
                      &in_single = files().build(single, scan, there).certificate;
    // What rounds in single precision is charged, and neither charge is the other's.
    BOOST_TEST(in_single.budget.arithmetic.value > 1.01 * in_double.budget.arithmetic.value);
    if (scan.name == "upright") continue;  // as the tilted one, but for the kernel of its nodes
    files().verify(single, scan, there);
    files().verify(single, scan, here);
    files().verify({}, scan, there);
    files().run(single,
                {"render", files().at(there), "--size", "64x64", "-o", files().at(scan.name + ".png")});
  }
}

BOOST_AUTO_TEST_CASE(less_rounding_than_any_device_has_is_told_on_every_device) {
  const Scan& scan = scans()[2];
  const VdvrFile& file = files().build({}, scan, scan.name + "-cpu.vdvr");
  Certificate c = file.certificate;
  const double less = 0.5 * c.budget.arithmetic.value;
  c.budget.arithmetic.value -= less;
  c.total_buffer -= less;
  if (c.total_image3d) *c.total_image3d -= less;
  write_vdvr(files().at("less.vdvr"), file.volume, c);
  Program program(std::filesystem::path(files().at("less.vdvr")).parent_path());
  program.environment = gpu_with("VDVR_SHIM_FP64", "0");
  program.environment["LD_PRELOAD"] = VDVR_OPENCL_SHIM;
  const Ended told = program.run({"verify", files().at("less.vdvr"), "--projections", files().path(scan)});
  BOOST_TEST(told.code == 1);
  BOOST_TEST((told.out + told.err).find("the arithmetic term") != std::string::npos, told.out + told.err);
}
