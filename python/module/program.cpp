// The command line, which the wheel brings as the command `vdvr`.
#include "apps/vdvr/program.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "parts.hpp"

namespace nb = nanobind;

namespace vdvr::python {

void add_program(nb::module_& m) {
  // It handles signals itself and asks Python for nothing.
  m.def("run_program", &cli::run_program, nb::arg("words"), nb::call_guard<nb::gil_scoped_release>(),
        "Runs the command line with these words. Gives the exit code.");
}

}  // namespace vdvr::python
