// The library's exceptions as Python's.
#include <nanobind/nanobind.h>

#include "parts.hpp"
#include "vdvr/error.hpp"

namespace nb = nanobind;

namespace vdvr::python {

void add_errors(nb::module_& m) {
  // Those that are registered last are tried first: a base comes before what derives from it. Each is also
  // what Python raises in such a case, so that who expects that catches it.
  const auto with = [](nb::handle ours, PyObject* theirs) {
    return nb::make_tuple(ours, nb::borrow(theirs));
  };
  const nb::exception<Error> error(m, "Error");
  const nb::exception<InputError> input(m, "InputError", with(error, PyExc_ValueError));
  nb::exception<FileError>(m, "FileError", with(input, PyExc_OSError));
  nb::exception<MismatchError>(m, "MismatchError", with(error, PyExc_ValueError));
  nb::exception<ToleranceError>(m, "ToleranceError", with(error, PyExc_ValueError));
  const nb::exception<DeviceError> device(m, "DeviceError", with(error, PyExc_RuntimeError));
  nb::exception<BuildError>(m, "BuildError", device);
  nb::exception<ResourceError>(m, "ResourceError", with(error, PyExc_MemoryError));
  nb::register_exception_translator([](const std::exception_ptr& p, void*) {
    try {
      std::rethrow_exception(p);
    } catch (const Interrupted& e) {
      PyErr_SetString(PyExc_KeyboardInterrupt, e.what());
    }
  });
}

}  // namespace vdvr::python
