#include "host/files/io/tiff_messages.hpp"

#include <array>
#include <string>

namespace vdvr::io {

int keep_tiff_message(TIFF*, void* user, const char*, const char* format, va_list arguments) {
  std::array<char, 512> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  auto& message = *static_cast<std::string*>(user);
  if (message.empty()) message = text.data();
  return 1;
}

}  // namespace vdvr::io
