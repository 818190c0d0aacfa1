# Runs export_readers.py, which reads what `vdvr export` writes by VTK, zarr, tifffile and h5py. Skipped where these
# cannot be had.
include("${CMAKE_CURRENT_LIST_DIR}/../support/python_packages.cmake")
find_python_with(export_readers_test 540 vtk "zarr>=3" tifffile h5py numpy)
if(NOT python)
  return()
endif()
execute_process(COMMAND "${python}" "${CMAKE_CURRENT_LIST_DIR}/export_readers.py" "${VDVR}" "${SOURCE}" RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "export_readers.py failed with ${code}")
endif()
