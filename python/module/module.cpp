// vdvr._core: the public library as the package `vdvr` needs it. Values and names are the library's; words of
// users, defaults and documentation are the package's.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "parts.hpp"

NB_MODULE(_core, m) {
  m.doc() = "The library behind the package vdvr. Use that.";
  m.attr("__version__") = VDVR_VERSION;
  vdvr::python::add_errors(m);
  vdvr::python::add_scans(m);
  vdvr::python::add_pictures(m);
  vdvr::python::add_volumes(m);
  vdvr::python::add_certified_pictures(m);
  vdvr::python::add_viewers(m);
  vdvr::python::add_files(m);
  vdvr::python::add_program(m);
  vdvr::python::add_measures(m);
  vdvr::python::add_audits(m);
}
