# Libraries from Debian, and ONNX Runtime where the set-up put it.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.5 REQUIRED COMPONENTS core imgproc imgcodecs features2d calib3d videoio video)
find_package(Ceres 2.1 REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(spdlog REQUIRED)
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)
find_package(opengv REQUIRED)
find_package(embree REQUIRED)  # 3 or 4

find_path(ONNXRUNTIME_INCLUDE_DIR onnxruntime_c_api.h
  HINTS ${ONNXRUNTIME_ROOT}/include $ENV{ONNXRUNTIME_ROOT}/include
        ${PROJECT_SOURCE_DIR}/build/deps/onnxruntime/include
  PATH_SUFFIXES onnxruntime onnxruntime/core/session)
find_library(ONNXRUNTIME_LIBRARY onnxruntime
  HINTS ${ONNXRUNTIME_ROOT}/lib $ENV{ONNXRUNTIME_ROOT}/lib
        ${PROJECT_SOURCE_DIR}/build/deps/onnxruntime/lib)
if(NOT ONNXRUNTIME_INCLUDE_DIR OR NOT ONNXRUNTIME_LIBRARY)
  message(FATAL_ERROR "ONNX Runtime was not found. Run tools/setup.sh first, "
                      "or pass -DONNXRUNTIME_ROOT=<folder with include/ and lib/>.")
endif()
add_library(rover_onnxruntime INTERFACE)
target_include_directories(rover_onnxruntime SYSTEM INTERFACE
  $<BUILD_INTERFACE:${ONNXRUNTIME_INCLUDE_DIR}>)
target_link_libraries(rover_onnxruntime INTERFACE
  $<BUILD_INTERFACE:${ONNXRUNTIME_LIBRARY}> $<INSTALL_INTERFACE:rover::onnxruntime_library>)

if(ROVER_BUILD_TESTS)
  find_package(GTest REQUIRED)
endif()
if(ROVER_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()
