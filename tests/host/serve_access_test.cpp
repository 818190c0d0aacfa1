// Whom `vdvr serve` lets in: heads of requests, hosts, origins, tokens, names. No device, no socket.
#define BOOST_TEST_MODULE serve_access
#include <boost/test/unit_test.hpp>

#include <set>

#include "apps/vdvr/serve/access.hpp"

using namespace vdvr::cli;

namespace {

const std::string kToken = "00112233445566778899aabbccddeeff";
const Access kAccess{kToken, {"localhost", "My-Machine.example"}};

std::optional<RequestHead> head_of(const std::string& line,
                                   const std::string& headers = "Host: localhost\r\n") {
  return parse_head(line + "\r\n" + headers + "\r\n");
}

int status_of(const std::string& line, const std::string& headers) {
  const auto head = head_of(line, headers);
  return head ? refusal_of(*head, kAccess) : 400;
}

std::string get(const std::string& name) { return "GET /" + kToken + "/" + name + " HTTP/1.1"; }
std::string post(const std::string& name) { return "POST /" + kToken + "/" + name + " HTTP/1.1"; }

}  // namespace

BOOST_AUTO_TEST_CASE(a_head_is_read_without_the_rest) {
  const auto head = head_of(post("frame/a/still"),
                            "hOsT: localhost:81\r\nOrigin:http://localhost:81\r\nContent-Length: 12\r\n"
                            "Content-Type: application/json \r\nRange: bytes=0-\r\nCookie: a=b\r\n");
  BOOST_REQUIRE(head);
  BOOST_TEST(head->host == "localhost:81");
  BOOST_TEST(head->origin == "http://localhost:81");
  BOOST_TEST(head->content_type == "application/json");
  BOOST_TEST(head->content_length == 12u);
  BOOST_TEST(!head->close);
  BOOST_TEST(head_of(get("") + "\r\nConnection: Close")->close);
  BOOST_TEST(parse_head("GET / HTTP/1.0\r\n\r\n")->close);
}

BOOST_AUTO_TEST_CASE(malformed_heads_are_none) {
  for (const char* line :
       {"GET / HTTP/2.0", "GET /", "get / HTTP/1.1", "DELETE / HTTP/1.1", "GET http://a/ HTTP/1.1",
        "GET /a?b HTTP/1.1", "GET /a%00 HTTP/1.1", "GET  / HTTP/1.1", "GET /\xc3\xa9 HTTP/1.1", ""})
    BOOST_TEST(!head_of(line), line);
  for (const char* headers :
       {"Host\r\n", "Ho st: a\r\n", ": a\r\n", "Host: a\r\n folded\r\n", "Host: a\r\nHost: b\r\n",
        "Content-Length: -1\r\n", "Content-Length: 1\r\nContent-Length: 1\r\n",
        "Content-Length: 9999999999\r\n", "Content-Length: 5\r\n", "Transfer-Encoding: chunked\r\n",
        "Content-Encoding: gzip\r\n", "Host: a\x01\r\n", "Host: a\x7f\r\n"})
    BOOST_TEST(!head_of("GET / HTTP/1.1", headers), headers);
  BOOST_TEST(!parse_head("GET / HTTP/1.1\r\nHost: a\r\n"));
  BOOST_TEST(!parse_head("GET / HTTP/1.1\r\nHost: a\r\n\r\nmore"));
  BOOST_TEST(!head_of("GET / HTTP/1.1", "X: " + std::string(kMostHead, 'x') + "\r\n"));
  BOOST_TEST(!head_of("GET /" + std::string(kMostTarget, 'x') + " HTTP/1.1"));
}

BOOST_AUTO_TEST_CASE(hosts_are_addresses_or_names_that_were_given) {
  for (const char* host : {"127.0.0.1", "127.0.0.1:8080", "192.0.2.7:1", "[::1]:80", "[::1]", "localhost",
                           "LOCALHOST:99999", "my-machine.EXAMPLE:80"})
    BOOST_TEST(is_allowed_host(host, kAccess.names), host);
  for (const char* host : {"", ":80", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example",
                           "localhost:", "localhost:x", "localhost:1:2", "[::1", "[::1]x", "::1",
                           "127.0.0.1:123456", "127.1", "0x7f000001"})
    BOOST_TEST(!is_allowed_host(host, kAccess.names), host);
}

BOOST_AUTO_TEST_CASE(only_who_has_the_token_and_comes_from_our_page_is_let_in) {
  const std::string host = "Host: localhost:81\r\n";
  BOOST_TEST(status_of(get(""), host) == 0);
  BOOST_TEST(status_of(get("page.js"), host) == 0);
  BOOST_TEST(status_of("GET / HTTP/1.1", host) == 404);
  BOOST_TEST(status_of("GET /" + kToken + " HTTP/1.1", host) == 404);
  BOOST_TEST(status_of("GET /00112233445566778899aabbccddeefe/ HTTP/1.1", host) == 404);
  BOOST_TEST(status_of("GET //" + kToken + "/ HTTP/1.1", host) == 404);
  BOOST_TEST(status_of(get("../" + kToken + "/"), host) == 404);
  BOOST_TEST(status_of(get(""), "") == 403);
  BOOST_TEST(status_of(get(""), "Host: evil.example\r\n") == 403);
  BOOST_TEST(status_of(get(""), host + "Origin: http://localhost:81\r\n") == 0);
  BOOST_TEST(status_of(get(""), host + "Origin: http://localhost:82\r\n") == 403);
  BOOST_TEST(status_of(get(""), host + "Origin: null\r\n") == 403);
}

BOOST_AUTO_TEST_CASE(frames_are_asked_for_by_json_of_bounded_size) {
  const std::string host = "Host: localhost\r\n", json = host + "Content-Type: application/json\r\n";
  BOOST_TEST(status_of(post("frame/Ab1/moving"), json + "Content-Length: 65536\r\n") == 0);
  BOOST_TEST(status_of(post("frame/Ab1/moving"), json + "Content-Length: 65537\r\n") == 413);
  BOOST_TEST(status_of(post("frame/Ab1/moving"), host + "Content-Length: 2\r\n") == 415);
  BOOST_TEST(status_of(get("frame/Ab1/moving"), host) == 405);
  BOOST_TEST(status_of(post("page.css"), json + "Content-Length: 2\r\n") == 405);
}

BOOST_AUTO_TEST_CASE(targets_are_names_that_we_know) {
  const auto asked = [](const std::string& rest) { return target_of("/t/" + rest).asked; };
  BOOST_TEST((asked("") == Resource::page));
  BOOST_TEST((asked("page.css") == Resource::style));
  const Target frame = target_of("/t/frame/Ab1/moving");
  BOOST_TEST((frame.asked == Resource::frame && frame.client == "Ab1" && frame.moving));
  BOOST_TEST(!target_of("/t/frame/a/still").moving);
  for (const std::string rest : {"page.html", "frame", "frame/", "frame//still", "frame/a/", "frame/a/still/",
                                 "frame/a.b/still", "frame/../still", "scene.json/", "../page.js"})
    BOOST_TEST((asked(rest) == Resource::nothing), rest);
  BOOST_TEST((asked("frame/" + std::string(33, 'a') + "/still") == Resource::nothing));
  BOOST_TEST((target_of("/t").asked == Resource::nothing));
  BOOST_TEST((target_of("").asked == Resource::nothing));
}

BOOST_AUTO_TEST_CASE(tokens_differ_and_are_compared_whole) {
  std::set<std::string> seen;
  for (int i = 0; i < 100; ++i) {
    const std::string token = random_token();
    BOOST_TEST(token.size() == 32u);
    BOOST_TEST(token.find_first_not_of("0123456789abcdef") == std::string::npos);
    seen.insert(token);
  }
  BOOST_TEST(seen.size() == 100u);
  BOOST_TEST(same_text(kToken, kToken));
  for (std::size_t i = 0; i < kToken.size(); ++i) {
    std::string other = kToken;
    other[i] ^= 1;
    BOOST_TEST(!same_text(kToken, other));
  }
  BOOST_TEST(!same_text(kToken, ""));
  BOOST_TEST(!same_text(kToken, kToken + "0"));
}
