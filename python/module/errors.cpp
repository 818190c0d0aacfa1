// The library's exceptions as Python's.
#include <nanobind/nanobind.h>

#include "parts.hpp"
#include "vdvr/error.hpp"

namespace nb = nanobind;

namespace vdvr::python {

void add_errors(nb::module_& m) {
  // Those that are registered last are tried first: a base comes before what derives from it.
  const nb::exception<Error> error(m, "Error");
  const nb::exception<InputError> input(m, "InputError", error);
  nb::exception<FileError>(m, "FileError", input);
  nb::exception<MismatchError>(m, "MismatchError", error);
  nb::exception<ToleranceError>(m, "ToleranceError", error);
  const nb::exception<DeviceError> device(m, "DeviceError", error);
  nb::exception<BuildError>(m, "BuildError", device);
  nb::exception<ResourceError>(m, "ResourceError", error);
  nb::register_exception_translator([](const std::exception_ptr& p, void*) {
    try {
      std::rethrow_exception(p);
    } catch (const Interrupted& e) {
      PyErr_SetString(PyExc_KeyboardInterrupt, e.what());
    }
  });
}

}  // namespace vdvr::python
