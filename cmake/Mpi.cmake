# vdvr-mpi: a program of its own, where MPI is found; `vdvr` does not link it. Debian has Open MPI (libopenmpi-dev) and MPICH
# (libmpich-dev); -DMPI_C_COMPILER=mpicc.mpich takes the latter where both are installed.
option(VDVR_MPI "Build vdvr-mpi where MPI is found" ON)
if(NOT VDVR_MPI)
  return()
endif()
find_package(MPI COMPONENTS C)
if(NOT MPI_C_FOUND)
  message(STATUS "vdvr-mpi is not built: no MPI was found (Debian: libopenmpi-dev or libmpich-dev)")
  return()
endif()
file(GLOB VDVR_MPI_SOURCES CONFIGURE_DEPENDS apps/mpi/*.cpp)

function(vdvr_add_mpi target output)
  add_executable(${target} ${VDVR_MPI_SOURCES} $<TARGET_OBJECTS:vdvr_commands>)
  set_target_properties(${target} PROPERTIES OUTPUT_NAME ${output})
  target_link_libraries(${target} PRIVATE vdvr_serve vdvr_warnings)
  # Its C++ interface is gone from the standard.
  target_compile_definitions(${target} PRIVATE OMPI_SKIP_MPICXX MPICH_SKIP_MPICXX)
endfunction()

vdvr_add_mpi(vdvr_mpi vdvr-mpi)
target_link_libraries(vdvr_mpi PRIVATE MPI::MPI_C)
if(BUILD_SHARED_LIBS)
  set_target_properties(vdvr_mpi PROPERTIES INSTALL_RPATH "$ORIGIN/${VDVR_LIB_FROM_BIN}")
endif()
# Its man page says where the options are: on those of `vdvr`.
if(NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR)
  set(VDVR_MPI_MANUAL "${CMAKE_BINARY_DIR}/mpi-manuals")
  add_custom_command(OUTPUT "${VDVR_MPI_MANUAL}/written"
    COMMAND "${CMAKE_COMMAND}" "-DOUTPUT=${VDVR_MPI_MANUAL}" "-DMPI=$<TARGET_FILE:vdvr_mpi>" "-DEPOCH=${VDVR_EPOCH}"
            -P "${CMAKE_SOURCE_DIR}/cmake/WriteManuals.cmake"
    DEPENDS vdvr_mpi "${CMAKE_SOURCE_DIR}/cmake/WriteManuals.cmake" VERBATIM)
  add_custom_target(vdvr_mpi_manual ALL DEPENDS "${VDVR_MPI_MANUAL}/written")
  install(DIRECTORY "${VDVR_MPI_MANUAL}/man1" DESTINATION "${CMAKE_INSTALL_MANDIR}" COMPONENT vdvr_mpi)
  install(DIRECTORY "${VDVR_MPI_MANUAL}/completions" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion" COMPONENT vdvr_mpi)
endif()
install(TARGETS vdvr_mpi RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT vdvr_mpi)

# For the tests, with Debian's MPICH beside another MPI.
find_program(VDVR_MPICC_MPICH mpicc.mpich)
find_program(VDVR_MPIEXEC_MPICH mpiexec.mpich)
if(VDVR_TESTS AND VDVR_MPICC_MPICH AND VDVR_MPIEXEC_MPICH AND NOT MPI_C_LIBRARIES MATCHES "mpich")
  execute_process(COMMAND "${VDVR_MPICC_MPICH}" -compile_info OUTPUT_VARIABLE compile OUTPUT_STRIP_TRAILING_WHITESPACE)
  execute_process(COMMAND "${VDVR_MPICC_MPICH}" -link_info OUTPUT_VARIABLE link OUTPUT_STRIP_TRAILING_WHITESPACE)
  separate_arguments(includes UNIX_COMMAND "${compile}")
  list(FILTER includes INCLUDE REGEX "^-I")
  list(TRANSFORM includes REPLACE "^-I" "")
  separate_arguments(libraries UNIX_COMMAND "${link}")
  list(FILTER libraries INCLUDE REGEX "^-[Ll]")
  vdvr_add_mpi(vdvr_mpi_mpich vdvr-mpi-mpich)
  target_include_directories(vdvr_mpi_mpich SYSTEM PRIVATE ${includes})
  target_link_libraries(vdvr_mpi_mpich PRIVATE ${libraries})
endif()
