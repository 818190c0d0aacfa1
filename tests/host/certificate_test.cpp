#define BOOST_TEST_MODULE certificate
#include <boost/test/unit_test.hpp>

#include <limits>
#include <nlohmann/json.hpp>

#include "tests/support/certificates.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certificate.hpp"

using namespace vdvr;
using nlohmann::json;

namespace {

const Certificate full = support::full_certificate();

std::string refusal(const json& j) {
  try {
    certificate_from_json(j.dump());
  } catch (const FileError& e) {
    return e.what();
  }
  return "accepted";
}

bool names(const std::string& message, const std::string& member) {
  return message.find("'" + member + "'") != std::string::npos;
}

}  // namespace

BOOST_AUTO_TEST_CASE(every_member_comes_back_to_the_bit) {
  const Certificate c = certificate_from_json(to_json(full));
  BOOST_TEST(to_json(c) == to_json(full));
  BOOST_TEST(c.epsilon == full.epsilon);
  BOOST_TEST(c.epsilon_abs == full.epsilon_abs);
  BOOST_TEST(c.reference_range == full.reference_range);
  BOOST_TEST((c.range_at == full.range_at));
  BOOST_TEST(c.holds_buffer == full.holds_buffer);
  BOOST_TEST((c.holds_image3d == full.holds_image3d));
  BOOST_TEST(c.total_buffer == full.total_buffer);
  BOOST_TEST((c.total_image3d == full.total_image3d));
  BOOST_TEST(c.budget.gold.value == full.budget.gold.value);
  BOOST_TEST(c.budget.sampler.image3d->method == full.budget.sampler.image3d->method);
  BOOST_TEST(c.worst_at == full.worst_at);
  BOOST_TEST(c.bounds.size() == full.bounds.size());
  BOOST_TEST(c.bounds[1].rate == 16);
  BOOST_TEST(c.bounds[1].rigorous);
  BOOST_TEST(*c.field.center == *full.field.center);
  BOOST_TEST(c.padding == full.padding);
  BOOST_TEST(c.window->second == full.window->second);
  BOOST_TEST(*c.roi == *full.roi);
  BOOST_TEST(c.input_shape == full.input_shape);
  BOOST_TEST(c.notes == full.notes);
  BOOST_TEST(json::parse(c.options_json) == json::parse(full.options_json));
}

BOOST_AUTO_TEST_CASE(members_have_the_names_of_the_file_format) {
  const json j = json::parse(to_json(full));
  for (const char* name :
       {"epsilon",        "epsilon_abs", "reference_range", "holds",  "total",  "budget",  "measured_max",
        "measured_total", "worst_at",    "rates",           "bounds", "field",  "window",  "roi",
        "not_covered",    "input",       "content_sha256",  "device", "driver", "version", "options",
        "notes"})
    BOOST_TEST(j.contains(name), name);
  BOOST_TEST(j["holds"]["image3d"] == true);
  BOOST_TEST(j["total"]["buffer"] == full.total_buffer);
  BOOST_TEST(j["budget"]["sampler"]["buffer"]["value"] == full.budget.sampler.buffer.value);
  BOOST_TEST(j["rates"] == json::parse(R"({"upsampling_u": 16, "u_filter": "linear", "gold": 8})"));
  BOOST_TEST(j["bounds"]["projection"]["16"][0]["value"] == full.bounds[1].value);
  BOOST_TEST(j["field"]["center"] == 85.85);
  BOOST_TEST(j["not_covered"]["count"] == 12);
  BOOST_TEST(j["input"]["shape"] == json::parse("[74, 65, 65]"));
}

BOOST_AUTO_TEST_CASE(how_dense_fourth_differences_are_is_said_of_cone_beam_alone) {
  Certificate c = full;
  BOOST_TEST(!json::parse(to_json(c))["rates"].contains("differences"));
  c.rates = {6, Interpolation::eight_taps, 8, sparse_differences};
  auto j = nlohmann::ordered_json::parse(to_json(c));
  BOOST_TEST(j["rates"]["differences"] == 4);
  BOOST_TEST((certificate_from_json(j.dump()).rates == c.rates));
  j["rates"]["differences"] = 5;
  BOOST_CHECK_EXCEPTION(certificate_from_json(j.dump()), FileError,
                        [](const FileError& e) { return names(e.what(), "rates.differences"); });
  j["rates"].erase("differences");  // as earlier programs wrote them
  BOOST_TEST(certificate_from_json(j.dump()).rates.differences == dense_differences);
}

BOOST_AUTO_TEST_CASE(what_does_not_apply_is_null_or_absent) {
  Certificate c = full;
  c.window.reset();
  c.roi.reset();
  c.field.center.reset();
  c.holds_image3d.reset();
  c.total_image3d.reset();
  c.budget.sampler.image3d.reset();
  auto j = nlohmann::ordered_json::parse(to_json(c));  // keeps the order of bounds
  BOOST_TEST(j["window"].is_null());
  BOOST_TEST(j["roi"].is_null());
  BOOST_TEST(j["field"]["center"].is_null());
  BOOST_TEST(!j["holds"].contains("image3d"));
  BOOST_TEST(!j["budget"]["sampler"].contains("image3d"));
  j["total"]["image3d"] = nullptr;
  const Certificate back = certificate_from_json(j.dump());
  BOOST_TEST(!back.window.has_value());
  BOOST_TEST(!back.holds_image3d.has_value());
  BOOST_TEST(!back.total_image3d.has_value());
  BOOST_TEST(to_json(back) == to_json(c));
}

BOOST_AUTO_TEST_CASE(nan_and_infinity_are_refused_by_name) {
  const auto refused = [](const Certificate& c, const std::string& member) {
    BOOST_CHECK_EXCEPTION(to_json(c), InputError,
                          [&](const InputError& e) { return names(e.what(), member); });
  };
  Certificate c = full;
  c.budget.gold.value = std::numeric_limits<double>::quiet_NaN();
  refused(c, "budget.gold.value");
  c = full;
  c.worst_at[1] = std::numeric_limits<double>::infinity();
  refused(c, "worst_at");
  c = full;
  c.window->first = -std::numeric_limits<double>::infinity();
  refused(c, "window");
  c = full;
  c.bounds[0].value = std::numeric_limits<double>::quiet_NaN();
  refused(c, "bounds");
  c = full;
  c.total_image3d = std::numeric_limits<double>::quiet_NaN();
  refused(c, "total.image3d");
}

BOOST_AUTO_TEST_CASE(options_that_are_no_json_object_are_refused) {
  Certificate c = full;
  for (const char* text : {"", "[1]", "{\"a\":", "3"}) {
    c.options_json = text;
    BOOST_CHECK_THROW(to_json(c), InputError);
  }
}

BOOST_AUTO_TEST_CASE(bytes_that_are_not_utf8_do_not_break_the_json) {
  Certificate c = full;
  c.input_name = "scan\xff.h5";
  BOOST_TEST(certificate_from_json(to_json(c)).input_sha256 == full.input_sha256);
}

BOOST_AUTO_TEST_CASE(a_missing_member_is_named) {
  const json whole = json::parse(to_json(full));
  for (const auto& [name, value] : whole.items()) {
    if (name == "notes" || name == "range_at") continue;  // optional
    json j = whole;
    j.erase(name);
    BOOST_TEST(names(refusal(j), name), name);
    if (!value.is_object() || name == "options" || name == "bounds") continue;
    for (const auto& [inner, unused] : value.items()) {
      if (inner == "image3d") continue;  // optional
      json k = whole;
      k[name].erase(inner);
      BOOST_TEST(names(refusal(k), name + "." + inner), name + "." + inner);
    }
  }
}

BOOST_AUTO_TEST_CASE(an_ill_typed_member_is_named) {
  const json whole = json::parse(to_json(full));
  for (const auto& [name, value] : whole.items()) {
    json j = whole;
    j[name] = value.is_boolean() ? json("no") : json(true);
    BOOST_TEST(names(refusal(j), name), name);
  }
  const auto with = [&](const char* pointer, const json& value) {
    json j = whole;
    j[json::json_pointer(pointer)] = value;
    return refusal(j);
  };
  BOOST_TEST(names(with("/epsilon", "3%"), "epsilon"));
  BOOST_TEST(names(with("/holds/buffer", 1), "holds.buffer"));
  BOOST_TEST(names(with("/budget/grid/value", nullptr), "budget.grid.value"));
  BOOST_TEST(names(with("/rates/gold", 0), "rates.gold"));
  BOOST_TEST(names(with("/rates/gold", 8.5), "rates.gold"));
  BOOST_TEST(names(with("/field/padding", 18446744073709551615ull), "field.padding"));
  BOOST_TEST(names(with("/worst_at", json::parse("[1, 2]")), "worst_at"));
  BOOST_TEST(names(with("/window", json::parse("[1, \"2\"]")), "window[1]"));
  BOOST_TEST(
      names(with("/bounds/gold/0x8", json::parse("[{\"method\": \"m\", \"value\": 1, \"rigorous\": true}]")),
            "bounds.gold.0x8"));
}

BOOST_AUTO_TEST_CASE(text_that_is_no_json_is_refused) {
  const std::string whole = to_json(full);
  BOOST_CHECK_THROW(certificate_from_json(""), FileError);
  BOOST_CHECK_THROW(certificate_from_json("[]"), FileError);
  BOOST_CHECK_THROW(certificate_from_json("{\"epsilon\": 1e999}"), FileError);
  BOOST_CHECK_THROW(certificate_from_json("{\"epsilon\": NaN}"), FileError);
  for (std::size_t length = 0; length < whole.size(); length += 37)
    BOOST_CHECK_THROW(certificate_from_json(whole.substr(0, length)), FileError);
}
