// The parts of the extension module, each of which puts its classes and functions into it.
#pragma once

#include <nanobind/nanobind.h>

namespace vdvr::python {

void add_errors(nanobind::module_& m);
void add_scans(nanobind::module_& m);
void add_pictures(nanobind::module_& m);
void add_volumes(nanobind::module_& m);
void add_certified_pictures(nanobind::module_& m);
void add_viewers(nanobind::module_& m);
void add_files(nanobind::module_& m);
void add_program(nanobind::module_& m);
void add_measures(nanobind::module_& m);
void add_audits(nanobind::module_& m);

}  // namespace vdvr::python
