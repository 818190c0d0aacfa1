// Text for HTML and for a shell (apps/vdvr/html.hpp): what is no text of HTML never gets onto a page.
#define BOOST_TEST_MODULE html
#include "apps/vdvr/html.hpp"

#include <boost/test/unit_test.hpp>
#include <limits>
#include <string>

using namespace vdvr::cli;

namespace {
const std::string mark = "\xEF\xBF\xBD";
}

BOOST_AUTO_TEST_CASE(marks_of_html_become_references) {
  BOOST_TEST(escaped("<script>\"'&amp;") == "&lt;script&gt;&quot;&#39;&amp;amp;");
  BOOST_TEST(escaped("\xC3\xA9 \xE2\x88\x92 \xF0\x9F\x99\x82\n") ==
             "\xC3\xA9 \xE2\x88\x92 \xF0\x9F\x99\x82\n");
}

BOOST_AUTO_TEST_CASE(bytes_that_html_does_not_allow_are_replaced) {
  BOOST_TEST(escaped(std::string("a\0b", 3)) == "a" + mark + "b");
  BOOST_TEST(escaped("\x1B[31m") == mark + "[31m");
  BOOST_TEST(escaped("\xFF<") == mark + "&lt;");
  // An overlong '<', a surrogate, a sequence cut short, a code point beyond Unicode, a noncharacter.
  BOOST_TEST(escaped("\xC0\xBC") == mark + mark);
  BOOST_TEST(escaped("\xED\xA0\x80") == mark + mark + mark);
  BOOST_TEST(escaped("\xE2\x88") == mark + mark);
  BOOST_TEST(escaped("\xE2\"x") == mark + "&quot;x");
  BOOST_TEST(escaped("\xF4\x90\x80\x80") == mark + mark + mark + mark);
  BOOST_TEST(escaped("\xEF\xBF\xBF") == mark);
}

// RFC 4648, section 10.
BOOST_AUTO_TEST_CASE(base64_is_that_of_the_standard) {
  BOOST_TEST(base64("") == "");
  BOOST_TEST(base64("f") == "Zg==");
  BOOST_TEST(base64("fo") == "Zm8=");
  BOOST_TEST(base64("foo") == "Zm9v");
  BOOST_TEST(base64("foobar") == "Zm9vYmFy");
  BOOST_TEST(base64("\xFF\xFE\xFD") == "//79");
}

BOOST_AUTO_TEST_CASE(a_shell_takes_words_back_as_they_were) {
  BOOST_TEST(shell_line({"vdvr", "run", "a b", "", "it's", "$(x)", "3%"}) ==
             "vdvr run 'a b' '' 'it'\\''s' '$(x)' 3%");
}

BOOST_AUTO_TEST_CASE(numbers_keep_their_value_and_none_is_no_number) {
  BOOST_TEST(number_html(0.00453593390062, "epsilon_abs") ==
             "<data value=\"0.00453593390062\" data-member=\"epsilon_abs\">0.004536</data>");
  BOOST_TEST(number_html(std::numeric_limits<double>::quiet_NaN()) == "\xE2\x80\x93");
  BOOST_TEST(number_html(std::numeric_limits<double>::infinity()) == "\xE2\x80\x93");
  BOOST_TEST(count_html(1234567) ==
             "<data value=\"1234567\">1\xE2\x80\xAF"
             "234\xE2\x80\xAF"
             "567</data>");
}
