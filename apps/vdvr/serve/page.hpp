// The page of `vdvr serve`, embedded by cmake/EmbedPage.cmake.
#pragma once

#include <string_view>

namespace vdvr::cli {

/// The text of "page.html", "page.css", "page.js" or "curve.js"; empty for any other name. Scripts are sent
/// as one.
std::string_view page_file(std::string_view name);

}  // namespace vdvr::cli
