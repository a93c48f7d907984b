# rover_module(NAME DEPENDS module... LIBRARIES target...)
#
# Makes the library rover_NAME of all sources in the calling folder, the test program
# rover_NAME_test of its *_test.cc.
function(rover_module name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;LIBRARIES;TEST_LIBRARIES" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  set(tests ${sources})
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  list(FILTER sources EXCLUDE REGEX "(_test|/main)\\.cc$")

  if(sources)
    set(scope PUBLIC)
    add_library(rover_${name} STATIC ${sources})
    rover_compile_options(rover_${name})
  else()  # headers only
    set(scope INTERFACE)
    add_library(rover_${name} INTERFACE)
  endif()
  add_library(rover::${name} ALIAS rover_${name})
  target_include_directories(rover_${name} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  list(TRANSFORM ARG_DEPENDS PREPEND rover_)
  target_link_libraries(rover_${name} ${scope} ${ARG_DEPENDS} ${ARG_LIBRARIES})
  set_property(GLOBAL APPEND PROPERTY ROVER_MODULES rover_${name})

  if(ROVER_BUILD_TESTS AND tests)
    add_executable(rover_${name}_test ${tests})
    target_link_libraries(rover_${name}_test PRIVATE rover_${name} ${ARG_TEST_LIBRARIES}
      GTest::gmock GTest::gtest_main)
    target_compile_definitions(rover_${name}_test PRIVATE
      ROVER_SOURCE_DIR="${PROJECT_SOURCE_DIR}" ROVER_BINARY_DIR="${PROJECT_BINARY_DIR}")
    rover_compile_options(rover_${name}_test)
    gtest_discover_tests(rover_${name}_test DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
      TEST_PREFIX "${name}." PROPERTIES TIMEOUT 900)
  endif()
endfunction()

# With the address sanitizer Eigen allocates in a way of its own, and what OpenGV (Debian's build)
# hands over could not be freed: it is told that malloc is aligned, as it is without the sanitizer.
# Warnings are errors; sanitizers when asked for. GCC 12 takes std::string's operator+ for
# overlapping memory (its bug 105651), and with sanitizers sees uninitialised values in Eigen.
function(rover_compile_options target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
  if(ROVER_SANITIZE)
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
    target_compile_definitions(${target} PUBLIC EIGEN_MALLOC_ALREADY_ALIGNED=1)
    target_compile_options(${target} PUBLIC -fsanitize=${ROVER_SANITIZE} -fno-omit-frame-pointer
      -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${ROVER_SANITIZE})
  endif()
endfunction()

# rover_kernel(target file flags...): a file of hot loops built for one instruction set and chosen
# at run time. No Eigen in it or its interface (DESIGN, section 3, machine code).
function(rover_kernel target file)
  set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "${ARGN}")
endfunction()

# rover_bench(NAME_bench.cc MODULE...): a Google Benchmark program, for bench/CMakeLists.txt.
function(rover_bench file)
  if(ROVER_BUILD_BENCHMARKS)
    get_filename_component(name ${file} NAME_WE)
    add_executable(rover_${name} ${file})
    list(TRANSFORM ARGN PREPEND rover_ OUTPUT_VARIABLE modules)
    target_link_libraries(rover_${name} PRIVATE ${modules} benchmark::benchmark)
    target_compile_definitions(rover_${name} PRIVATE ROVER_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    rover_compile_options(rover_${name})
  endif()
endfunction()
