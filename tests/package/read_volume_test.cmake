# examples/read_volume.py gives the values that `vdvr probe` gives. Skipped where h5py cannot be had.
include("${CMAKE_CURRENT_LIST_DIR}/../support/h5py.cmake")
find_h5py(read_volume_test)
if(NOT python)
  return()
endif()
execute_process(COMMAND "${python}" "${CMAKE_CURRENT_LIST_DIR}/read_volume_test.py" "${SOURCE}/examples/read_volume.py" "${VDVR}"
  RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "read_volume_test.py failed with ${code}")
endif()
