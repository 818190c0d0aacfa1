# find_h5py(NAME): a Python with h5py in `python`, or nothing, and "NAME skipped" was said.
include("${CMAKE_CURRENT_LIST_DIR}/python_packages.cmake")
macro(find_h5py test)
  find_python_with(${test} 240 h5py numpy)
endmacro()
