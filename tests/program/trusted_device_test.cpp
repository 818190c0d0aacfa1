// Devices that compute badly: a layer makes the arithmetic of a good one wrong, and the test that every
// device is given when it is opened names what is. Such a device draws when asked to, and certifies nothing.
#define BOOST_TEST_MODULE trusted_device
#include <boost/test/unit_test.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/program.hpp"

namespace fs = std::filesystem;
using namespace vdvr::support;
using Json = nlohmann::json;

namespace {

using Words = std::vector<std::string>;

/// A program whose devices are bad, with a cache of its own.
struct Bad : Program {
  TemporaryFolder folder;
  explicit Bad(const std::string& replace = "", const std::string& options = "") : Program(fs::path()) {
    static_cast<Program&>(*this) = Program(folder.path());
    environment["XDG_CACHE_HOME"] = (folder / "cache").string();
    environment["VDVR_KERNEL_WARNINGS"] = "";
    // What the compiler keeps is one for all: it knows programs by their text and options.
    static const TemporaryFolder compiled;
    environment["POCL_CACHE_DIR"] = compiled.path().string();
    if (replace.empty() && options.empty()) return;
    environment["LD_PRELOAD"] = VDVR_OPENCL_FAULTS;
    environment["VDVR_FAULTS_REPLACE"] = replace;
    environment["VDVR_FAULTS_OPTIONS"] = options;
  }
  [[nodiscard]] Json test() const {
    const Ended ended = run({"devices", "--probe", "--json"});
    BOOST_REQUIRE_MESSAGE(ended.code == 0, ended.err);
    const Json devices = Json::parse(ended.out)["devices"];
    BOOST_REQUIRE(!devices.empty());
    BOOST_REQUIRE_MESSAGE(devices[0].contains("test"), devices[0].dump());
    return devices[0]["test"];
  }
};

std::set<std::string> failed(const Json& test) {
  std::set<std::string> names;
  for (const Json& check : test["checks"])
    if (!check["passed"].get<bool>()) names.insert(check["name"].get<std::string>());
  return names;
}

/// A small scan and its certified volume, by a good device.
struct Inputs {
  TemporaryFolder folder;
  std::string scan = (folder / "scan.h5").string(), volume = (folder / "in.vdvr").string();
  Inputs() {
    const Program program(folder.path());
    for (const Words& words :
         {Words{"simulate", "--phantom", "sphere", "--detector", "17x5", "--angles", "24", "-o", scan},
          Words{"build", scan, "--epsilon", "8%", "-o", volume}}) {
      const Ended made = program.run(words);
      BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
    }
  }
};
const Inputs& inputs() {
  static const Inputs one;
  return one;
}

const char* const contracts = "#pragma OPENCL FP_CONTRACT OFF=>#pragma OPENCL FP_CONTRACT ON";

}  // namespace

BOOST_AUTO_TEST_CASE(a_device_that_computes_as_it_should_passes_and_is_remembered) {
  const Bad good;
  const Json first = good.test();
  BOOST_TEST(first["passed"].get<bool>(), first.dump());
  BOOST_TEST(!first["remembered"].get<bool>());
  std::set<std::string> names;
  for (const Json& check : first["checks"]) names.insert(check["name"].get<std::string>());
  for (const char* name :
       {"contraction", "two-sum", "fma", "division", "square root", "conversions", "subnormals",
        "infinity and NaN", "integers", "atomics", "select and masks", "sampler"})
    BOOST_TEST(names.count(name) == 1u, name);
  const Json again = good.test();
  BOOST_TEST(again["remembered"].get<bool>());
  BOOST_TEST(again["checks"] == first["checks"]);
  // A file that is not whole, or holds anything else, is as if there were none.
  int files = 0;
  for (const auto& entry : fs::directory_iterator(good.folder / "cache" / "vdvr" / "devices")) {
    ++files;
    fs::resize_file(entry.path(), fs::file_size(entry.path()) / 2);
  }
  BOOST_TEST(files == 1);
  BOOST_TEST(!good.test()["remembered"].get<bool>());
  BOOST_TEST(good.test()["remembered"].get<bool>());
}

BOOST_AUTO_TEST_CASE(several_processes_test_one_device_at_once) {
  const Bad good;
  std::vector<pid_t> started;
  for (int i = 0; i < 4; ++i)
    started.push_back(good.start({"devices", "--probe", "--json"}, "std." + std::to_string(i)));
  for (int i = 0; i < 4; ++i) {
    const Ended ended = good.finish(started[static_cast<std::size_t>(i)], "std." + std::to_string(i));
    BOOST_TEST(ended.code == 0, ended.err);
    BOOST_TEST(Json::parse(ended.out)["devices"][0]["test"]["passed"].get<bool>());
  }
  BOOST_TEST(good.test()["remembered"].get<bool>());
  for (const auto& entry : fs::directory_iterator(good.folder / "cache" / "vdvr" / "devices"))
    BOOST_TEST(entry.path().extension() != ".part");
}

BOOST_AUTO_TEST_CASE(without_a_cache_every_device_is_tested) {
  Bad good;
  good.environment["VDVR_CACHE"] = "off";
  BOOST_TEST(!good.test()["remembered"].get<bool>());
  BOOST_TEST(!good.test()["remembered"].get<bool>());
  good.environment["VDVR_CACHE"] = "";
  good.environment["XDG_CACHE_HOME"] = good.folder.file("file", "no folder").string();
  BOOST_TEST(good.test()["passed"].get<bool>());
}

BOOST_AUTO_TEST_CASE(whatever_is_computed_badly_is_named) {
  struct Case {
    const char *replace, *options, *name;
  };
  for (const Case& c : {
           Case{contracts, "", "contraction"},
           Case{"", "-cl-fast-relaxed-math", "two-sum"},
           Case{"", "-cl-fast-relaxed-math", "infinity and NaN"},
           Case{"fma(a, b, c)=>(a * b + c)", "", "fma"},
           Case{"PUT(a / b)=>PUT(a * as_float(as_int(1.0f / b) + 4))", "", "division"},
           Case{"sqrt(a)=>as_float(as_int(sqrt(a)) + 4)", "", "square root"},
           Case{"PUT((float)m)=>PUT(convert_float_rtz(m))", "", "conversions"},
           Case{"PUT(odd * 0.25f)=>PUT(odd * 0.25f * 0.0f)", "", "subnormals"},
           Case{"PUT_BITS(m / d)=>PUT_BITS(m / d - (m < 0))", "", "integers"},
           Case{"atomic_max(totals + 1, m)=>totals[1] = m", "", "atomics"},
           Case{"PUT(PICK(m > n, a, b))=>PUT(PICK(-(m > n) < -1, a, b))", "", "select and masks"},
           Case{"return (1.0f - t) * a + t * b;=>return a + t * (b - a);", "", "sampler"},
       }) {
    const Bad bad(c.replace, c.options);
    const Json test = bad.test();
    BOOST_TEST_CONTEXT(c.replace << c.options << ": " << test.dump()) {
      BOOST_TEST(!test["passed"].get<bool>());
      BOOST_TEST(failed(test).count(c.name) == 1u);
    }
    // What failed is not remembered.
    BOOST_TEST(!fs::exists(bad.folder / "cache" / "vdvr" / "devices"));
  }
}

BOOST_AUTO_TEST_CASE(a_bad_device_draws_when_asked_to_and_certifies_nothing) {
  const Inputs& in = inputs();
  const Bad bad(contracts);
  const auto out = [&](const char* name) { return (bad.folder / name).string(); };
  const std::vector<Words> certifying{
      {"build", in.scan, "--epsilon", "8%", "-o", out("o.vdvr")},
      {"run", in.scan, "--epsilon", "8%", "-o", out("o.dir")},
      {"verify", in.volume, "--projections", in.scan},
      {"render", in.volume, "--certify", "--size", "16x16", "-o", out("c.png")}};
  for (const bool asked : {false, true})
    for (Words words : certifying) {
      if (asked) words.emplace_back("--untrusted-device");
      const Ended r = bad.run(words);
      BOOST_TEST_CONTEXT(words[0] << (asked ? " asked" : "") << ": " << r.err) {
        BOOST_TEST(r.code == 3);
        BOOST_TEST(r.err.find("contraction") != std::string::npos);
        for (const char* name : {"o.vdvr", "o.dir", "c.png"}) BOOST_TEST(!fs::exists(bad.folder / name));
      }
    }
  Words draw{"render", in.volume, "--size", "16x16", "-o", out("d.png")};
  const Ended refused = bad.run(draw);
  BOOST_TEST(refused.code == 3);
  BOOST_TEST(refused.err.find("--untrusted-device") != std::string::npos, refused.err);
  BOOST_TEST(!fs::exists(bad.folder / "d.png"));
  draw.emplace_back("--untrusted-device");
  const Ended drawn = bad.run(draw);
  BOOST_TEST(drawn.code == 0, drawn.err);
  BOOST_TEST(drawn.err.find("is not trusted: contraction") != std::string::npos, drawn.err);
  BOOST_TEST(fs::exists(bad.folder / "d.png"));
}
