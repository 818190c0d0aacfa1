// A recursive reader of a small dialect of XML; see xml_file.hpp.
#include "host/files/io/xml_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "host/files/io/text_encoding.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t largest_file = 64u << 20;
constexpr int deepest = 16;
constexpr int most_elements = 1 << 19;  // some 40,000 views of RTK's

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool continues_name(char c) { return starts_name(c) || (c >= '0' && c <= '9') || c == '-' || c == '.'; }

class Reader {
 public:
  Reader(const fs::path& path, std::string_view text) : path_(path), text_(text) {}

  XmlElement document() {
    if (take("<?xml")) skip_past("?>", "the XML declaration");
    skip_between();
    if (take("<!DOCTYPE")) {
      skip_blanks();
      static_cast<void>(name());
      skip_blanks();
      if (!take(">")) fail("a document type with content is not supported; leave the DOCTYPE out");
      skip_between();
    }
    XmlElement root = element(1);
    skip_between();
    if (at_ != text_.size()) fail("something follows the root element");
    return root;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(fmt::format("{}: line {}: {}", path_.string(), line(), what));
  }
  // Counted on from where it was last asked for: once for each element.
  int line() const {
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted_),
                                         text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n'));
    counted_ = at_;
    return line_;
  }
  bool take(std::string_view word) {
    if (text_.substr(at_, word.size()) != word) return false;
    at_ += word.size();
    return true;
  }
  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  }
  void skip_past(std::string_view end, const char* what) {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) fail(fmt::format("the file ends within {}: truncated", what));
    at_ = found + end.size();
  }
  // Blanks and comments, which may lie before and after the root.
  void skip_between() {
    for (skip_blanks(); take("<!--"); skip_blanks()) skip_past("-->", "a comment");
  }

  std::string name() {
    const std::size_t first = at_;
    if (at_ < text_.size() && starts_name(text_[at_]))
      while (at_ < text_.size() && continues_name(text_[at_])) ++at_;
    if (at_ == first) fail("a name is missing: not XML, or truncated");
    return std::string(text_.substr(first, at_ - first));
  }

  char entity() {
    static const std::map<std::string_view, char> known{
        {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
    for (const auto& [word, c] : known)
      if (take(word)) return c;
    fail("an entity other than &lt; &gt; &amp; &quot; &apos; is not supported");
  }

  void attribute(XmlElement& element) {
    const std::string key = name();
    skip_blanks();
    if (!take("=")) fail(fmt::format("attribute '{}' has no '='", key));
    skip_blanks();
    const char quote = take("\"") ? '"' : take("'") ? '\'' : '\0';
    if (quote == '\0') fail(fmt::format("attribute '{}' has no quotes", key));
    std::string value;
    while (at_ < text_.size() && text_[at_] != quote) {
      if (text_[at_] == '<') fail(fmt::format("attribute '{}' holds '<'", key));
      value += text_[at_] == '&' ? entity() : text_[at_++];
    }
    if (at_ == text_.size()) fail(fmt::format("the file ends within attribute '{}': truncated", key));
    ++at_;
    if (!element.attributes.emplace(key, value).second)
      fail(fmt::format("attribute '{}' is given twice", key));
  }

  XmlElement element(int depth) {
    if (depth > deepest) fail(fmt::format("elements lie deeper than {}", deepest));
    if (!take("<")) fail("an element is missing: not XML, or truncated");
    if (++elements_ > most_elements) fail(fmt::format("more than {} elements", most_elements));
    XmlElement out;
    out.name = name();
    out.line = line();
    for (skip_blanks(); at_ < text_.size() && starts_name(text_[at_]); skip_blanks()) attribute(out);
    if (take("/>")) return out;
    if (!take(">")) fail(fmt::format("'{}' is not closed by '>'", out.name));
    content(out, depth);
    return out;
  }

  // Up to and including the end tag.
  void content(XmlElement& out, int depth) {
    while (at_ < text_.size()) {
      if (take("</")) {
        if (const std::string end = name(); end != out.name)
          fail(fmt::format("'{}' of line {} is ended by '{}'", out.name, out.line, end));
        skip_blanks();
        if (!take(">")) fail(fmt::format("the end of '{}' is not closed by '>'", out.name));
        return;
      }
      if (take("<!--")) skip_past("-->", "a comment");
      else if (text_.substr(at_, 2) == "<!" || text_.substr(at_, 2) == "<?")
        fail("CDATA, declarations and processing instructions are not supported");
      else if (text_[at_] == '<') out.children.push_back(element(depth + 1));
      else out.text += text_[at_] == '&' ? entity() : text_[at_++];
    }
    fail(fmt::format("the file ends within '{}' of line {}: truncated", out.name, out.line));
  }

  fs::path path_;
  std::string_view text_;
  std::size_t at_ = 0;
  int elements_ = 0;
  mutable std::size_t counted_ = 0;
  mutable int line_ = 1;
};

}  // namespace

XmlElement read_xml(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) throw FileError(path.string() + ": no such file, or not readable");
  const std::string text = read_text(path, "a geometry file", largest_file);
  return Reader(path, text).document();
}

}  // namespace vdvr::io
