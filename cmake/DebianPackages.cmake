# Debian packages by component, for cpack -G DEB; scripts/debian-packages makes, checks and tries them. vdvr: programs, man pages,
# completion, ParaView's reader; vdvr-mpi, where MPI is found; libvdvr0.1: the shared library; libvdvr-dev: what a program is built with; vdvr-doc: documents
# and scans. The two of the library are left out where only the static one is built.
set(VDVR_MAINTAINER "VDVR developers <developers@vdvr.invalid>" CACHE STRING
    "Who answers for the Debian packages; the default is nobody's address")
set(VDVR_DEB_RELEASE 1)
set(VDVR_DEB_VERSION "${PROJECT_VERSION}-${VDVR_DEB_RELEASE}")
set(VDVR_ABI "${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
set(VDVR_DEB_FILES "${CMAKE_BINARY_DIR}/package/debian")
find_program(VDVR_GZIP gzip)
if(NOT VDVR_GZIP OR NOT TARGET vdvr_manuals)
  return()
endif()

# --- copyright, changelogs --------------------------------------------------------------------------------------------
# Text as the fields of Debian's copyright format want it: indented, with a dot for an empty line.
function(vdvr_read_licence file result)
  file(READ "${file}" text)
  string(REGEX REPLACE "[ \t\r]+\n" "\n" text "${text}\n")
  string(REGEX REPLACE "\n+$" "" text "${text}")
  string(REPLACE "\n" "\n " text " ${text}")
  foreach(twice IN ITEMS 1 2)  # the end of one empty line is the beginning of the next
    string(REPLACE "\n \n" "\n .\n" text "${text}")
  endforeach()
  set(${result} "${text}" PARENT_SCOPE)
endfunction()
vdvr_read_licence("${CMAKE_SOURCE_DIR}/data/aps-tooth/LICENSE.txt" VDVR_ARGONNE)
vdvr_read_licence("${CMAKE_SOURCE_DIR}/data/cone-head/LICENSE.txt" VDVR_VTK)
configure_file(cmake/debian/copyright.in "${VDVR_DEB_FILES}/copyright" @ONLY)
execute_process(COMMAND "${CMAKE_COMMAND}" -E env LC_ALL=C date -u -R -d "@${VDVR_EPOCH}" OUTPUT_VARIABLE day
                OUTPUT_STRIP_TRAILING_WHITESPACE)
file(WRITE "${VDVR_DEB_FILES}/changelog.Debian"
     "vdvr (${VDVR_DEB_VERSION}) unstable; urgency=medium\n\n  * VDVR ${PROJECT_VERSION}; changelog.gz says what changed.\n\n"
     " -- ${VDVR_MAINTAINER}  ${day}\n")
configure_file("${CMAKE_SOURCE_DIR}/CHANGELOG.md" "${VDVR_DEB_FILES}/changelog" COPYONLY)
foreach(name IN ITEMS changelog changelog.Debian)
  execute_process(COMMAND "${VDVR_GZIP}" -9nc "${VDVR_DEB_FILES}/${name}" OUTPUT_FILE "${VDVR_DEB_FILES}/${name}.gz")
endforeach()

# --- what goes where --------------------------------------------------------------------------------------------------
function(vdvr_deb_papers component package)
  install(FILES "${VDVR_DEB_FILES}/copyright" "${VDVR_DEB_FILES}/changelog.gz" "${VDVR_DEB_FILES}/changelog.Debian.gz"
          DESTINATION "share/doc/${package}" COMPONENT ${component} EXCLUDE_FROM_ALL)
  file(READ cmake/debian/lintian-overrides overrides)
  if(NOT package MATCHES "^lib.*[0-9]$")
    string(REGEX REPLACE "# CPack[^\n]*\n[^#]*" "" overrides "${overrides}")
  endif()
  file(WRITE "${VDVR_DEB_FILES}/${package}" "${overrides}")
  install(FILES "${VDVR_DEB_FILES}/${package}" DESTINATION share/lintian/overrides COMPONENT ${component} EXCLUDE_FROM_ALL)
endfunction()
vdvr_deb_papers(deb_program vdvr)
vdvr_deb_papers(deb_documents vdvr-doc)
# The links between documents stay good.
install(FILES README.md CONTRIBUTING.md SECURITY.md CITATION.cff DESTINATION share/doc/vdvr-doc COMPONENT deb_documents EXCLUDE_FROM_ALL)
install(DIRECTORY docs data DESTINATION share/doc/vdvr-doc COMPONENT deb_documents EXCLUDE_FROM_ALL)
set(CPACK_COMPONENTS_ALL vdvr_program deb_program deb_documents)
if(TARGET vdvr_mpi)
  vdvr_deb_papers(deb_mpi vdvr-mpi)
  list(APPEND CPACK_COMPONENTS_ALL vdvr_mpi deb_mpi)
endif()
if(BUILD_SHARED_LIBS)
  set(shared vdvr)
elseif(TARGET vdvr_twin)
  set(shared vdvr_twin)
endif()
if(shared)
  vdvr_deb_papers(deb_library "libvdvr${VDVR_ABI}")
  vdvr_deb_papers(deb_headers libvdvr-dev)
  install(TARGETS ${shared} LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT deb_library NAMELINK_COMPONENT deb_headers
          EXCLUDE_FROM_ALL)
  install(DIRECTORY include/vdvr DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT deb_headers EXCLUDE_FROM_ALL)
  install(EXPORT vdvrTargets_shared FILE vdvr_shared.cmake NAMESPACE vdvr:: DESTINATION "${VDVR_CMAKE_DIR}" COMPONENT deb_headers
          EXCLUDE_FROM_ALL)
  install(FILES "${CMAKE_BINARY_DIR}/package/shared/vdvrConfig.cmake" "${CMAKE_BINARY_DIR}/vdvrConfigVersion.cmake"
          DESTINATION "${VDVR_CMAKE_DIR}" COMPONENT deb_headers EXCLUDE_FROM_ALL)
  install(FILES "${CMAKE_BINARY_DIR}/package/shared/vdvr.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT deb_headers
          EXCLUDE_FROM_ALL)
  install(DIRECTORY examples DESTINATION share/doc/libvdvr-dev COMPONENT deb_headers EXCLUDE_FROM_ALL)
  list(APPEND CPACK_COMPONENTS_ALL deb_library deb_headers)
endif()

# --- control ----------------------------------------------------------------------------------------------------------
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME vdvr)
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_PACKAGE_VENDOR "VDVR developers")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
# A summary of the whole would be put before the description of each package.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${VDVR_DEB_RELEASE})
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${VDVR_MAINTAINER}")
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# vdvr_deb_package(GROUP NAME SECTION DESCRIPTION COMPONENTS...)
set(about "VDVR turns X-ray CT projections and an error tolerance into a volume of\nmixed resolution that is certified to lie\
 within the tolerance of the\nfield that the projections define, and renders it without a window on\nany OpenCL device.\n\n")
macro(vdvr_deb_package group name section description)
  string(TOUPPER "${group}" upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME "${name}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION "${section}")
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${description}")
  if(NOT "${name}" STREQUAL "vdvr")
    set(CPACK_DEBIAN_${upper}_PACKAGE_SOURCE vdvr)
  endif()
  foreach(component IN ITEMS ${ARGN})
    string(TOUPPER "${component}" upper_component)
    set(CPACK_COMPONENT_${upper_component}_GROUP "${group}")
  endforeach()
endmacro()
vdvr_deb_package(vdvr vdvr science "certified volumes and pictures of X-ray CT projections\n${about}This package has the\
 programs, their manual pages and completion, and\nParaView's reader of .vdvr files." vdvr_program deb_program)
set(CPACK_DEBIAN_VDVR_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_VDVR_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_VDVR_PACKAGE_SUGGESTS
    "vdvr-doc, hdf5-filter-plugin, hdf5-filter-plugin-blosc-serial, bitshuffle, paraview, python3-h5py")
if(TARGET vdvr_mpi)
  vdvr_deb_package(vdvr_mpi vdvr-mpi science "certified volumes of X-ray CT projections: for clusters\n${about}This package has\
 vdvr-mpi, whose builds are spread over the ranks of an\nMPI job." vdvr_mpi deb_mpi)
  set(CPACK_DEBIAN_VDVR_MPI_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_VDVR_MPI_PACKAGE_RECOMMENDS "openmpi-bin, pocl-opencl-icd | opencl-icd")
  set(CPACK_DEBIAN_VDVR_MPI_PACKAGE_SUGGESTS "vdvr, vdvr-doc")
endif()
vdvr_deb_package(vdvr_doc vdvr-doc doc "certified volumes of X-ray CT projections: documents and scans\n${about}This package\
 has the documents, and three scans to try." deb_documents)
set(CPACK_DEBIAN_VDVR_DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_VDVR_DOC_PACKAGE_MULTIARCH foreign)
if(shared)
  vdvr_deb_package(libvdvr "libvdvr${VDVR_ABI}" libs "certified volumes of X-ray CT projections: shared library\n${about}This\
 package has the shared library." deb_library)
  set(CPACK_DEBIAN_LIBVDVR_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
  set(CPACK_DEBIAN_LIBVDVR_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
  set(CPACK_DEBIAN_LIBVDVR_PACKAGE_MULTIARCH same)
  set(CPACK_DEBIAN_LIBVDVR_PACKAGE_CONTROL_EXTRA "${CMAKE_SOURCE_DIR}/cmake/debian/triggers")
  vdvr_deb_package(libvdvr_dev libvdvr-dev libdevel "certified volumes of X-ray CT projections: development files\n${about}This\
 package has the headers, what CMake and pkg-config need, and\nexamples." deb_headers)
  set(CPACK_DEBIAN_LIBVDVR_DEV_PACKAGE_DEPENDS "libvdvr${VDVR_ABI} (= ${VDVR_DEB_VERSION})")
endif()
if(BUILD_SHARED_LIBS)
  set(CPACK_DEBIAN_VDVR_PACKAGE_DEPENDS "libvdvr${VDVR_ABI} (= ${VDVR_DEB_VERSION})")
  set(CPACK_DEBIAN_VDVR_MPI_PACKAGE_DEPENDS "libvdvr${VDVR_ABI} (= ${VDVR_DEB_VERSION})")
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_BINARY_DIR}")
endif()
include(CPack)
