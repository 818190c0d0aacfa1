# Man pages and completion, made by the programs themselves. A program of another machine cannot be asked.
if(CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
  return()
endif()
# The day that pages and the Debian changelog bear: of the source, so that a build can be repeated.
set(VDVR_EPOCH "$ENV{SOURCE_DATE_EPOCH}")
find_package(Git QUIET)
if(NOT VDVR_EPOCH AND GIT_FOUND)
  execute_process(COMMAND "${GIT_EXECUTABLE}" log -1 --format=%ct WORKING_DIRECTORY "${CMAKE_SOURCE_DIR}"
    OUTPUT_VARIABLE VDVR_EPOCH OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT VDVR_EPOCH)
  string(TIMESTAMP VDVR_EPOCH "%s" UTC)
endif()
set(VDVR_MANUALS "${CMAKE_BINARY_DIR}/manuals")
add_custom_command(OUTPUT "${VDVR_MANUALS}/written"
  COMMAND "${CMAKE_COMMAND}" "-DOUTPUT=${VDVR_MANUALS}" "-DVDVR=$<TARGET_FILE:vdvr_cli>" "-DPAPER=$<TARGET_FILE:vdvr_paper>"
          "-DEPOCH=${VDVR_EPOCH}" -P "${CMAKE_SOURCE_DIR}/cmake/WriteManuals.cmake"
  DEPENDS vdvr_cli vdvr_paper "${CMAKE_SOURCE_DIR}/cmake/WriteManuals.cmake" VERBATIM)
add_custom_target(vdvr_manuals ALL DEPENDS "${VDVR_MANUALS}/written")
install(DIRECTORY "${VDVR_MANUALS}/man1" DESTINATION "${CMAKE_INSTALL_MANDIR}" COMPONENT vdvr_program)
install(DIRECTORY "${VDVR_MANUALS}/completions" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion" COMPONENT vdvr_program)
