// Devices that compute badly: a layer makes the arithmetic of a good one wrong, and the test that every
// device is given when it is opened names what is. Such a device draws when asked to, and certifies nothing.
#define BOOST_TEST_MODULE trusted_device
#include <boost/test/unit_test.hpp>
#include <nlohmann/json.hpp>

#include "tests/support/program.hpp"

namespace fs = std::filesystem;
using namespace vdvr::support;
using Json = nlohmann::json;

namespace {

using Words = std::vector<std::string>;

/// A program whose device is bad, with a cache of its own.
struct Bad : Program {
  TemporaryFolder folder;
  explicit Bad(const std::string& replace = "", const std::string& options = "") : Program(fs::path()) {
    static_cast<Program&>(*this) = Program(folder.path());
    environment["XDG_CACHE_HOME"] = (folder / "cache").string();
    environment["VDVR_KERNEL_WARNINGS"] = "";  // compilers may warn of what is planted
    // What the compiler keeps is one for all: it knows programs by their text and options.
    static const TemporaryFolder compiled;
    environment["POCL_CACHE_DIR"] = compiled.path().string();
    if (replace.empty() && options.empty()) return;
    environment["LD_PRELOAD"] = VDVR_OPENCL_FAULTS;
    environment["VDVR_FAULTS_REPLACE"] = replace;
    environment["VDVR_FAULTS_OPTIONS"] = options;
  }
  [[nodiscard]] fs::path remembered() const { return folder / "cache" / "vdvr" / "devices"; }
  [[nodiscard]] Json probe() const {
    const Ended ended = run({"devices", "--probe", "--device", "0", "--json"});
    BOOST_REQUIRE_MESSAGE(ended.code == 0, ended.err);
    const Json devices = Json::parse(ended.out)["devices"];
    BOOST_REQUIRE(devices.size() == 1u);
    BOOST_REQUIRE_MESSAGE(devices[0].contains("test"), devices[0].dump());
    return devices[0]["test"];
  }
};

/// A small scan and its certified volume, by a good device.
struct Inputs {
  TemporaryFolder folder;
  std::string scan = (folder / "scan.h5").string(), volume = (folder / "in.vdvr").string();
  Json certificate;
  Inputs() {
    const Program program(folder.path());
    for (const Words& words :
         {Words{"simulate", "--phantom", "sphere", "--detector", "17x5", "--angles", "24", "-o", scan},
          Words{"build", scan, "--epsilon", "8%", "-o", volume}}) {
      const Ended made = program.run(words);
      BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
    }
    const Ended info = program.run({"info", volume, "--json"});
    BOOST_REQUIRE_MESSAGE(info.code == 0, info.err);
    certificate = Json::parse(info.out);
  }
};
const Inputs& inputs() {
  static const Inputs one;
  return one;
}

const std::vector<std::string> checks{"contraction", "two-sum",          "fma",        "division",
                                      "square root", "conversions",      "subnormals", "infinity and NaN",
                                      "integers",    "select and masks", "atomics",    "sampler"};
const char* const contracts = "#pragma OPENCL FP_CONTRACT OFF=>#pragma OPENCL FP_CONTRACT ON";

}  // namespace

BOOST_AUTO_TEST_CASE(a_device_that_computes_as_it_should_passes_and_is_remembered) {
  Bad good;
  const Json first = good.probe();
  BOOST_TEST(first["passed"].get<bool>(), first.dump());
  BOOST_TEST(!first["remembered"].get<bool>());
  BOOST_REQUIRE(first["checks"].size() >= checks.size());  // double precision, where there is
  for (std::size_t i = 0; i < checks.size(); ++i) BOOST_TEST(first["checks"][i]["name"] == checks[i]);
  const Json again = good.probe();
  BOOST_TEST(again["remembered"].get<bool>());
  BOOST_TEST(again["checks"] == first["checks"]);
  // A file that is not whole, or holds anything else, is as if there were none.
  int files = 0;
  for (const auto& entry : fs::directory_iterator(good.remembered())) {
    ++files;
    fs::resize_file(entry.path(), fs::file_size(entry.path()) / 2);
  }
  BOOST_TEST(files == 1);
  BOOST_TEST(!good.probe()["remembered"].get<bool>());
  BOOST_TEST(good.probe()["remembered"].get<bool>());
  // Another driver is asked anew: this layer adds what it changes to the driver's version.
  good.environment["LD_PRELOAD"] = VDVR_OPENCL_SHIM;
  good.environment["VDVR_SHIM_COMPUTE_UNITS"] = "3";
  BOOST_TEST(!good.probe()["remembered"].get<bool>());
  good.environment.erase("LD_PRELOAD");
  BOOST_TEST(good.probe()["remembered"].get<bool>());
}

BOOST_AUTO_TEST_CASE(a_certificate_says_what_its_device_was_tested_for) {
  bool said = false;
  for (const Json& note : inputs().certificate.flatten())
    said = said || (note.is_string() &&
                    note.get<std::string>().find("was tested when it was opened, and "
                                                 "passed: contraction, two-sum") != std::string::npos);
  BOOST_TEST(said, inputs().certificate.dump());
}

BOOST_AUTO_TEST_CASE(several_processes_test_one_device_at_once) {
  const Bad good;
  std::vector<pid_t> started;
  for (int i = 0; i < 4; ++i)
    started.push_back(good.start({"devices", "--device", "0", "--json"}, "std." + std::to_string(i)));
  for (int i = 0; i < 4; ++i) {
    const Ended ended = good.finish(started[static_cast<std::size_t>(i)], "std." + std::to_string(i));
    BOOST_TEST(ended.code == 0, ended.err);
  }
  int files = 0;
  for (const auto& entry : fs::directory_iterator(good.remembered())) {
    BOOST_TEST(entry.path().extension() != ".part");
    ++files;
  }
  BOOST_TEST(files == 1);
  BOOST_TEST(good.probe()["remembered"].get<bool>());
}

BOOST_AUTO_TEST_CASE(without_a_cache_every_device_is_tested) {
  Bad good;
  good.environment["VDVR_CACHE"] = "off";
  BOOST_TEST(!good.probe()["remembered"].get<bool>());
  BOOST_TEST(!good.probe()["remembered"].get<bool>());
  good.environment["VDVR_CACHE"] = "";
  good.environment["XDG_CACHE_HOME"] = good.folder.file("file", "no folder").string();
  BOOST_TEST(good.probe()["passed"].get<bool>());
}

BOOST_AUTO_TEST_CASE(whatever_is_computed_badly_is_named_and_by_how_much) {
  struct Case {
    const char *replace, *options, *name;
  };
  for (const Case& c : {
           // As compilers do it.
           Case{contracts, "", "contraction (a b + c: "},
           Case{"", "-cl-fast-relaxed-math", "two-sum (what a + b rounds off: "},
           Case{"", "-cl-denorms-are-zero", "subnormals (a "},
           // As devices do it.
           Case{"fma(a, b, c)=>(a * b + c)", "", "fma (fma(a, b, c): "},
           Case{"PUT(a / b)=>PUT(a * as_float(as_int(1.0f / b) + 4))", "", "units in the last place"},
           Case{"PUT(a / b)=>PUT(a * as_float(as_int(1.0f / b) + 4))", "", "division (a / b: "},
           Case{"sqrt(a)=>as_float(as_int(sqrt(a)) + 4)", "", "square root (sqrt(a): "},
           Case{"PUT((float)m)=>PUT(convert_float_rtz(m))", "", "conversions (int to float: "},
           Case{"(nan == nan) << 1=>1 << 1", "", "infinity and NaN (comparisons: "},
           Case{"PUT_BITS(m / d)=>PUT_BITS(m / d - (m < 0))", "", "integers (m / d: "},
           Case{"atomic_max(totals + 1, m)=>totals[1] = m", "", "atomics (a total is wrong"},
           Case{"PUT(PICK(m > n, a, b))=>PUT(PICK(-(m > n) < -1, a, b))", "", "select and masks (select: "},
           Case{"return (1.0f - t) * a + t * b;=>return a + t * (b - a);", "",
                "sampler (the field at points: "},
       }) {
    const Bad bad(c.replace, c.options);
    const Ended refused = bad.run({"render", inputs().volume, "--size", "16x16", "-o", "o.png"});
    BOOST_TEST_CONTEXT(c.replace << c.options << ": " << refused.err) {
      BOOST_TEST(refused.code == 3);
      BOOST_TEST(refused.err.find("does not compute as certificates assume") != std::string::npos);
      BOOST_TEST(refused.err.find(c.name) != std::string::npos);
      BOOST_TEST(refused.err.find("(driver ") != std::string::npos);
    }
    // What failed is not remembered.
    BOOST_TEST(!fs::exists(bad.remembered()));
  }
}

BOOST_AUTO_TEST_CASE(a_bad_device_is_shown_with_what_failed) {
  const Bad bad(contracts);
  const Json test = bad.probe();
  BOOST_TEST(!test["passed"].get<bool>());
  for (const Json& check : test["checks"]) {
    const auto name = check["name"].get<std::string>();
    const bool sound = name != "contraction" && name != "double precision" && name != "sampler";
    if (sound) BOOST_TEST(check["passed"].get<bool>(), check.dump());
    BOOST_TEST(check["passed"].get<bool>() == check["found"].get<std::string>().empty());
  }
  const Ended shown = bad.run({"devices", "--probe", "--device", "0"});
  BOOST_TEST(shown.out.find("failed: nothing is certified with it") != std::string::npos, shown.out);
  BOOST_TEST(shown.out.find("a b + c: ") != std::string::npos, shown.out);
}

BOOST_AUTO_TEST_CASE(a_good_device_certifies_a_volume_while_it_is_probed_and_a_bad_one_is_not_asked) {
  const auto shown = [](const Program& program) {
    const Ended ended = program.run({"devices", "--probe", "--device", "0", "--json"});
    BOOST_REQUIRE_MESSAGE(ended.code == 0, ended.err);
    return Json::parse(ended.out);
  };
  const TemporaryFolder folder;
  const Json good = shown(Program(folder.path()));
  BOOST_TEST(good["devices"][0]["cube"]["holds"].get<bool>(), good.dump());
  BOOST_TEST(good["devices"][0]["cube"]["found"] == "");
  BOOST_TEST(!good["setup"]["drivers"].empty());
  BOOST_TEST(good["setup"]["loader"].get<std::string>().find("OpenCL") != std::string::npos);
  BOOST_TEST(!shown(Bad(contracts))["devices"][0].contains("cube"));
}

BOOST_AUTO_TEST_CASE(a_bad_device_draws_when_asked_to_and_certifies_nothing) {
  const Inputs& in = inputs();
  const Bad bad(contracts);
  const auto out = [&](const char* name) { return (bad.folder / name).string(); };
  for (const Words& words :
       {Words{"build", in.scan, "--epsilon", "8%", "-o", out("o.vdvr")},
        Words{"run", in.scan, "--epsilon", "8%", "-o", out("o.dir")},
        Words{"verify", in.volume, "--projections", in.scan},
        Words{"reconstruct", in.scan, "--size", "8x8x2", "-o", out("o.mha")},
        Words{"render", in.volume, "--certify", "--size", "16x16", "-o", out("c.png")},
        Words{"render", in.volume, "--certify", "--untrusted-device", "--size", "16x16", "-o", out("c.png")},
        Words{"render", in.volume, "--certify", "--untrusted-device", "--mode", "iso", "--size", "16x16",
              "-o", out("c.png")},
        Words{"render", in.volume, "--mode", "error", "--projections", in.scan, "--untrusted-device",
              "--size", "64x64", "-o", out("c.png")},
        Words{"render", in.volume, "--size", "16x16", "-o", out("c.png")}}) {
    const Ended r = bad.run(words);
    BOOST_TEST_CONTEXT(words[0] << ": " << r.err) {
      BOOST_TEST(r.code == 3);
      BOOST_TEST(r.err.find("contraction (a b + c: ") != std::string::npos);
      BOOST_TEST((r.err.find("--untrusted-device") != std::string::npos ||
                  r.err.find("needs a device that computes as certificates assume") != std::string::npos));
      for (const char* name : {"o.vdvr", "o.dir", "o.mha", "c.png"})
        BOOST_TEST(!fs::exists(bad.folder / name));
    }
  }
  // Whoever makes certificates has no such option.
  const Ended none =
      bad.run({"build", in.scan, "--untrusted-device", "--epsilon", "8%", "-o", out("o.vdvr")});
  BOOST_TEST(none.code == 2);
  const Words draw{"render", in.volume, "--untrusted-device", "--size",
                   "16x16",  "-o",      out("d.png"),         "--json"};
  const Ended drawn = bad.run(draw);
  BOOST_REQUIRE_MESSAGE(drawn.code == 0, drawn.err);
  BOOST_TEST(drawn.err.find("is not trusted: contraction") != std::string::npos, drawn.err);
  BOOST_TEST(fs::exists(bad.folder / "d.png"));
  const Json json = Json::parse(drawn.out);
  BOOST_TEST(!json["device_trusted"].get<bool>());
  BOOST_TEST(!json["verified"].get<bool>());
  BOOST_TEST(json["epsilon_abs"].is_null());
}

BOOST_AUTO_TEST_CASE(a_transform_that_errs_by_a_millionth_ends_the_command) {
  // As a GPU, which filters rows of any length by FFTs of the device. One twiddle of clFFT's is off.
  Bad bad("(8.0901699=>(8.0901599");
  bad.environment["LD_PRELOAD"] = VDVR_OPENCL_FAULTS ":" VDVR_OPENCL_SHIM;
  bad.environment["VDVR_SHIM_GPU"] = "1";
  const std::string out = (bad.folder / "o.mha").string();
  const Words words{"reconstruct", inputs().scan, "--size", "8x8x2", "-o", out};
  const Ended told = bad.run(words);
  BOOST_TEST(told.code == 3);
  BOOST_TEST(told.err.find("clFFT on '") != std::string::npos, told.err);
  BOOST_TEST(told.err.find("of a row of length 40 it makes") != std::string::npos, told.err);
  BOOST_TEST(!fs::exists(out));
  bad.environment["VDVR_FAULTS_REPLACE"] = "";
  BOOST_TEST(bad.run(words).code == 0);
}

BOOST_AUTO_TEST_CASE(a_bad_device_is_passed_over_for_a_good_one) {
  Bad good;
  good.environment["POCL_DEVICES"] = "basic pthread";
  const Ended listed = good.run({"devices", "--json"});
  BOOST_REQUIRE_MESSAGE(listed.code == 0, listed.err);
  if (Json::parse(listed.out)["devices"].size() != 2u) {
    BOOST_TEST_MESSAGE(
        "a_bad_device_is_passed_over_for_a_good_one: skipped, PoCL alone makes two devices of one");
    return;
  }
  good.environment["LD_PRELOAD"] = VDVR_OPENCL_FAULTS;
  // The first to be built is the test of the first device.
  good.environment["VDVR_FAULTS_FAIL"] = "clBuildProgram:1";
  const Words draw{"render", inputs().volume, "--size", "16x16", "-o", (good.folder / "d.png").string()};
  const Ended drawn = good.run(draw);
  BOOST_TEST(drawn.code == 0, drawn.err);
  BOOST_TEST(drawn.err.find("going on with '") != std::string::npos, drawn.err);
  BOOST_TEST(fs::exists(good.folder / "d.png"));
}
