// Marks the functions and classes that a shared library of VDVR shows of itself: all of include/vdvr.
#pragma once

#if defined(__GNUC__)
#define VDVR_API __attribute__((visibility("default")))
#else
#define VDVR_API
#endif
