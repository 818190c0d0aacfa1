// What libtiff has to say, kept for the exception.
#pragma once

#include <tiffio.h>

#include <cstdarg>

namespace vdvr::io {

/// An error handler of libtiff: the first message goes into the std::string that `user` points to. Returns 1:
/// handled, so that the global handlers stay silent.
int keep_tiff_message(TIFF* file, void* user, const char* module, const char* format, va_list arguments);

}  // namespace vdvr::io
