# Installs Rover into a prefix of its own, builds examples/minimal against it with find_package, and
# runs it.   cmake -DBUILD=... -DSOURCE=... -DWORK=... -P test_install.cmake
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed (${result}): ${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${WORK}/prefix/bin/rover --version)
run(${CMAKE_COMMAND} -G Ninja -S ${SOURCE}/examples/minimal -B ${WORK}/build
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${WORK}/build)

set(cam0 ${SOURCE}/../shared/data/euroc/V1_01_clip/mav0/cam0)
if(EXISTS ${cam0})
  file(GLOB images ${cam0}/data/*.png)
  list(SORT images)
  list(SUBLIST images 0 40 images)
  set(ENV{ROVER_MODELS} ${WORK}/prefix/share/rover/models)
  run(${WORK}/build/minimal ${cam0}/sensor.yaml ${images})
  if(NOT output MATCHES "[0-9.]+( -?[0-9.]+)+")
    message(FATAL_ERROR "the example printed no pose:\n${output}")
  endif()
else()
  message("no sequence in ${cam0}: the example was built, but not run")
endif()
file(REMOVE_RECURSE ${WORK})
