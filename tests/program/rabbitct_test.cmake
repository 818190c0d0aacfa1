# bench/peers/fdk on stand-ins for RabbitCT's modules, in both forms of its interface. Skipped where h5py cannot be had.
include("${CMAKE_CURRENT_LIST_DIR}/../support/h5py.cmake")
find_h5py(rabbitct_test)
if(NOT python)
  return()
endif()
# peers(CODE SAYS FOLDER MODULE): the exit code, and a part of what is said.
function(peers expected says folder module)
  execute_process(COMMAND python3 "${SOURCE}/bench/peers/fdk" --venv "${VENV}" --no-install --vdvr "${VDVR}" --no-rtk
    --rabbitct "${CMAKE_CURRENT_LIST_DIR}/rabbitct/${folder}" --rabbitct-module ${module} --size 24 --angles 36 --rounds 1
    RESULT_VARIABLE code OUTPUT_VARIABLE said ERROR_VARIABLE complained)
  string(FIND "${said}${complained}" "${says}" found)
  if(NOT code EQUAL expected OR found EQUAL -1)
    message(FATAL_ERROR "${folder}/${module}: exit code ${code}, not ${expected}, or no '${says}' in:\n${said}${complained}")
  endif()
endfunction()
peers(0 "| rabbitct |" original Bilinear)
peers(0 "| rabbitct |" later Bilinear)
peers(1 "peers/fdk/agreement" original Unweighted)
peers(77 "holds no LolaBunny.c" later LolaBunny)
peers(77 "is no folder" missing Bilinear)
