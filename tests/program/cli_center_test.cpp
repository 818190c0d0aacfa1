// vdvr center: what it prints, the sheet, what it refuses, and what other commands say of an unsure centre.
#define BOOST_TEST_MODULE cli_center
#include <boost/test/unit_test.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"
#include "tests/support/places.hpp"

using namespace vdvr::support;

namespace {

const std::string tooth = std::string(vdvr::support::source_dir) + "/data/aps-tooth/tooth.h5",
                  head = std::string(vdvr::support::source_dir) + "/data/cone-head";

// What data/README.md gives for the tooth, and done-when 3 of the command: a quarter of a column.
constexpr double quarter_column = 0.25;

nlohmann::json centre_of(std::vector<std::string> words) {
  words.insert(words.begin(), "center");
  words.insert(words.end(), {"--json", "--force"});
  const Ended r = run(words);
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  return nlohmann::json::parse(r.out);
}

// Width and height stand in the first chunk of a PNG.
std::pair<unsigned, unsigned> size_of_png(const std::string& path) {
  const std::string bytes = bytes_of(path);
  BOOST_REQUIRE(bytes.size() > 24u);
  BOOST_REQUIRE(bytes.substr(1, 3) == "PNG");
  const auto number = [&](std::size_t at) {
    unsigned n = 0;
    for (std::size_t i = at; i < at + 4; ++i) n = 256 * n + static_cast<unsigned char>(bytes[i]);
    return n;
  };
  return {number(16), number(20)};
}

// Discs about an axis at column `center`, `turn` parts of a turn, as an MHA stack that states no centre.
void write_stack(const std::string& stack, const std::string& angles, std::int64_t columns,
                 std::int64_t views, double turn, double center, double size) {
  std::string text, samples;
  for (std::int64_t k = 0; k < views; ++k) {
    const double part = turn * static_cast<double>(k) / static_cast<double>(views),
                 theta = 2 * std::acos(-1.0) * part;
    text += std::to_string(360 * part) + "\n";
    for (std::int64_t i = 0; i < columns; ++i) {
      float p = 0;
      for (const auto& [x, y, r] :
           {std::array{4.0, -9.0, 40.0}, std::array{-20.0, 10.0, 7.0}, std::array{15.0, 22.0, 5.0}}) {
        const double t = (static_cast<double>(i) - center) / size - x * std::cos(theta) - y * std::sin(theta);
        if (std::abs(t) < r) p += static_cast<float>(0.04 * std::sqrt(r * r - t * t));
      }
      samples.append(reinterpret_cast<const char*>(&p), sizeof p);
    }
  }
  write(angles, text);
  write(stack, "ObjectType = Image\nNDims = 3\nDimSize = " + std::to_string(columns) + " 1 " +
                   std::to_string(views) +
                   "\nElementType = MET_FLOAT\nElementSpacing = 1 1 1\nElementByteOrderMSB = False\n"
                   "ElementDataFile = LOCAL\n" +
                   samples);
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_tooth_s_centre_is_found_and_its_sheet_drawn) {
  const std::string sheet = at("tooth.png");
  const auto json = centre_of({tooth, "-o", sheet, "--count", "5", "--step", "1"});
  const auto& found = json.at("found");
  BOOST_TEST(found.at("sure") == true);
  BOOST_TEST(std::abs(found.at("center").get<double>() - 295.9) <= quarter_column);
  BOOST_TEST(!found.at("others").empty());
  const auto& slices = json.at("sheet").at("slices");
  BOOST_TEST(slices.size() == 5u);
  BOOST_TEST(std::abs(slices[4].at("center").get<double>() - found.at("center").get<double>() - 2) < 1e-9);
  // The merit is least at the slice in the middle.
  BOOST_TEST(json.at("sheet").at("best") == slices[2].at("center"));
  const auto [width, height] = size_of_png(sheet);
  BOOST_TEST(width > 5u * 300u);
  BOOST_TEST(height > 300u);
}

BOOST_AUTO_TEST_CASE(the_centre_of_a_binned_scan_is_in_columns_of_the_file) {
  const auto json = centre_of({tooth, "--binning", "2"});
  BOOST_TEST(std::abs(json.at("found").at("center").get<double>() - 295.9) <= 2 * quarter_column);
}

BOOST_AUTO_TEST_CASE(a_cone_beam_scan_has_its_centre_and_sheet_too) {
  const auto json = centre_of({head, "-o", at("head.png"), "--count", "3", "--step", "2"});
  BOOST_TEST(json.at("found").at("sure") == true);
  BOOST_TEST(std::abs(json.at("found").at("center").get<double>() - 47.5) <= quarter_column);
  BOOST_TEST(json.at("sheet").at("best") == json.at("sheet").at("slices")[1].at("center"));
  static_cast<void>(size_of_png(at("head.png")));
}

BOOST_AUTO_TEST_CASE(without_an_output_it_prints_and_draws_nothing) {
  const Ended r = run({"center", tooth});
  BOOST_TEST(r.code == 0, r.err);
  BOOST_TEST(r.out.find("centre         295.8") != std::string::npos, r.out);
  BOOST_TEST(r.out.find("sure") != std::string::npos);
  BOOST_TEST(r.out.find("written") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(an_unsure_centre_is_called_so_and_the_note_of_other_commands_names_the_remedy) {
  // Of a quarter turn only the centroids say something. A stack states no centre.
  const std::string stack = at("quarter.mha"), angles = at("quarter.txt");
  write_stack(stack, angles, 64, 60, 0.25, 30.3, 0.5);
  const auto json = centre_of({stack, "--angles-file", angles, "-o", at("quarter.png"), "--count", "3"});
  BOOST_TEST(json.at("found").at("sure") == false);
  BOOST_TEST(json.at("found").at("doubt").get<std::string>().find("no second method") != std::string::npos);
  static_cast<void>(size_of_png(at("quarter.png")));
  const Ended info = run({"info", stack, "--angles-file", angles});
  BOOST_TEST(info.code == 0, info.err);
  BOOST_TEST(info.out.find("UNSURE") != std::string::npos, info.out);
  BOOST_TEST(info.out.find("`vdvr center`") != std::string::npos, info.out);
}

BOOST_AUTO_TEST_CASE(a_half_acquisition_is_found_and_drawn_and_taken_as_such) {
  const std::string stack = at("half.mha"), angles = at("half.txt");
  write_stack(stack, angles, 60, 120, 1, 9.3, 1);
  const auto json =
      centre_of({stack, "--angles-file", angles, "-o", at("half.png"), "--count", "5", "--step", "1"});
  BOOST_TEST(json.at("found").at("sure") == true);
  BOOST_TEST(std::abs(json.at("found").at("center").get<double>() - 9.3) <= quarter_column);
  BOOST_TEST(json.at("sheet").at("joined") == true);
  BOOST_TEST(json.at("sheet").at("best") == json.at("sheet").at("slices")[2].at("center"));
  BOOST_TEST(json.at("half_acquisition") == true);
  // Said by whoever recognises it, unless it was stated; of half a turn it is refused.
  const std::vector<std::string> plan{"reconstruct", stack, "--angles-file",      angles, "--force", "--size",
                                      "20x20x1",     "-o",  at("half_volume.mha")};
  const auto with = [&](const std::string& said) {
    std::vector<std::string> words = plan;
    words.insert(words.end(), {"--half-acquisition", said});
    return run(words);
  };
  const Ended recognised = run(plan), stated = with("on"), off = with("off");
  BOOST_TEST(recognised.code == 0, recognised.err);
  BOOST_TEST(recognised.err.find("WARNING: half acquisition: a full turn about an axis at column 9.2") !=
                 std::string::npos,
             recognised.err);
  BOOST_TEST(stated.code == 0, stated.err);
  BOOST_TEST(stated.err.find("WARNING") == std::string::npos, stated.err);
  BOOST_TEST(off.code == 0, off.err);
  write_stack(at("half_turn.mha"), angles, 60, 120, 0.5, 9.3, 1);
  check_refused({"reconstruct", at("half_turn.mha"), "--angles-file", angles, "--half-acquisition", "on",
                 "--center", "9.3", "-o", at("half_volume.mha"), "--force"},
                "needs a full turn");
}

BOOST_AUTO_TEST_CASE(what_makes_no_sheet_is_refused_by_name) {
  const std::string sheet = at("refused.png");
  check_refused({"center", tooth, "-o", at("sheet.jpg")}, ".png");
  check_refused({"center", tooth, "-o", sheet, "--count", "4"}, "--count");
  check_refused({"center", tooth, "-o", sheet, "--count", "1"}, "--count");
  check_refused({"center", tooth, "-o", sheet, "--step", "0"}, "--step");
  check_refused({"center", tooth, "-o", sheet, "--row", "2"}, "--row");
  check_refused({"center", tooth, "-o", sheet, "--step", "100"}, "leaves the detector");
  check_refused({"center", tooth, "--row", "1"}, "--output asks");
  check_refused({"center", at("nothing.h5"), "-o", sheet}, "no such file");
  BOOST_TEST(!std::filesystem::exists(sheet));
  write(sheet, "mine");
  check_refused({"center", tooth, "-o", sheet}, "--force");
  BOOST_TEST(bytes_of(sheet) == "mine");
  check_no_temporary_file_is_left();
}
