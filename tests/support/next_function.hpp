// The function behind a preloaded one of the same name. Used by the layers that tests and
// bench/host_stages preload.
#pragma once

#include <dlfcn.h>

#include <cstring>

template <typename Function>
Function next(const char* name) {
  void* found = ::dlsym(RTLD_NEXT, name);
  Function function = nullptr;
  std::memcpy(&function, &found, sizeof function);
  return function;
}
