// The part of XML that geometry files use: elements, attributes, text, comments. No document type but its
// bare name, no entity but the five of the language, nothing that names another file.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vdvr::io {

struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::string text;  ///< all of it, without that of the children
  std::vector<XmlElement> children;
  int line = 0;  ///< of the file, for messages
};

/// The root element. Throws FileError, which names the line: not well-formed, beyond the dialect, larger than
/// 64 MiB, deeper than 16 elements, more than 2^19 of them.
XmlElement read_xml(const std::filesystem::path& path);

}  // namespace vdvr::io
