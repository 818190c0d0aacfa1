// The page of results and the plots on it.
#define BOOST_TEST_MODULE page
#include <boost/test/unit_test.hpp>

#include <limits>

#include "host/field_panels.hpp"
#include "host/line_plot.hpp"
#include "host/page.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

BOOST_AUTO_TEST_CASE(base64_matches_the_vectors_of_rfc_4648) {
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) BOOST_TEST(base64(bytes) == text);
  BOOST_TEST(base64("\xff\xfe") == "//4=");
}

BOOST_AUTO_TEST_CASE(csv_quotes_what_would_split_a_row) {
  const PageTable table{"t", "", {"a", "b"}, {{"1,5", "say \"x\""}, {"plain", ""}}};
  BOOST_TEST(csv(table) == "a,b\n\"1,5\",\"say \"\"x\"\"\"\nplain,\n");
}

BOOST_AUTO_TEST_CASE(page_holds_everything_in_itself) {
  Page page{"A & B", {"less < more"}, {}};
  Image image{2, 1, {1, 2, 3, 4, 5, 6}};
  page.sections.push_back({"S",
                           {},
                           {{"p", "plot", svg({"t", "x", "y", {{"c", {{0, 1}, {1, 2}}}}})}},
                           {{"i", "picture", image}},
                           {{"t", "table", {"h"}, {{"<td>"}}}},
                           {}});
  const std::string text = html(page);
  BOOST_TEST(text.find("A &amp; B") != std::string::npos);
  BOOST_TEST(text.find("less &lt; more") != std::string::npos);
  BOOST_TEST(text.find("&lt;td&gt;") != std::string::npos);
  BOOST_TEST(text.find("src=\"data:image/png;base64,iVBORw0KGgo") != std::string::npos);
  BOOST_TEST(text.find("<path d=\"M") != std::string::npos);
  for (const char* outside : {"src=\"http", "href=", "<script", "@import", "url("})
    BOOST_TEST(text.find(outside) == std::string::npos);
}

BOOST_AUTO_TEST_CASE(plot_leaves_out_what_it_cannot_show) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string text = svg({"t", "x", "y", {{"c", {{1, 0.1}, {2, 0}, {3, nan}, {4, 10}}}}, true});
  BOOST_TEST(text.find("nan") == std::string::npos);
  BOOST_TEST(text.find("inf") == std::string::npos);
  BOOST_CHECK_THROW(svg({"t", "x", "y", {{"c", {{1, nan}}}}}), InputError);
}

BOOST_AUTO_TEST_CASE(panels_of_two_sizes_are_refused) {
  const FieldPanel small{"a", 1, 1, {0}}, large{"b", 2, 1, {0, 0}};
  BOOST_CHECK_THROW(field_panels({small, large}, {}, PanelColours::heat, ""), InputError);
  BOOST_CHECK_THROW(field_panels({}, {}, PanelColours::heat, ""), InputError);
  BOOST_CHECK_THROW(titled_pictures({}, 2), InputError);
}

BOOST_AUTO_TEST_CASE(grey_panels_show_the_ends_of_the_scale) {
  const FieldPanel panel{"", 3, 1, {0, 1, std::numeric_limits<double>::quiet_NaN()}};
  const Image image = field_panels({panel}, {0, 1, false}, PanelColours::grey, "");
  // The panel lies one gap from the left, a gap and a line of text from the top.
  bool found = false;
  for (std::int64_t y = 0; y < image.height && !found; ++y) {
    const auto* row = image.rgb.data() + (y * image.width + 12) * 3;
    found = row[0] == 0 && row[1] == 0 && row[3] == 255 && row[4] == 255 && row[6] == 120 && row[7] == 160;
  }
  BOOST_TEST(found);
}
