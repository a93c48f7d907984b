# cmake --install, and find_package(rover) afterwards: the target rover::rover is the whole library
# behind rover/slam/system.h, one rover::NAME per folder stands for those who want less.
include(CMakePackageConfigHelpers)

get_property(rover_modules GLOBAL PROPERTY ROVER_MODULES)
list(REMOVE_ITEM rover_modules rover_cli)
foreach(module ${rover_modules})
  string(REPLACE "rover_" "" name ${module})
  set_target_properties(${module} PROPERTIES EXPORT_NAME ${name})
endforeach()

add_library(rover_rover INTERFACE)
add_library(rover::rover ALIAS rover_rover)
target_link_libraries(rover_rover INTERFACE ${rover_modules})
set_target_properties(rover_rover PROPERTIES EXPORT_NAME rover)
set_target_properties(rover_onnxruntime PROPERTIES EXPORT_NAME onnxruntime)

add_custom_target(rover_install DEPENDS ${rover_modules})
set(rover_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/rover)

install(TARGETS rover_rover ${rover_modules} rover_onnxruntime EXPORT roverTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT roverTargets NAMESPACE rover:: DESTINATION ${rover_cmake_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/rover DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.h")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/build/models/ DESTINATION ${CMAKE_INSTALL_DATADIR}/rover/models)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/NOTICE
  DESTINATION ${CMAKE_INSTALL_DOCDIR})

# A runtime of the system stays where it is. One that the set-up fetched, or that was unpacked
# somewhere, moves along: programs find it in a folder of our own.
get_filename_component(rover_runtime ${ONNXRUNTIME_LIBRARY} REALPATH)
string(FIND ${rover_runtime} "/usr/lib" rover_runtime_in_system)
if(rover_runtime_in_system EQUAL 0)
  set(ROVER_INSTALLED_RUNTIME ${ONNXRUNTIME_LIBRARY})
else()
  get_filename_component(rover_runtime_name ${rover_runtime} NAME)
  install(FILES ${rover_runtime} DESTINATION ${CMAKE_INSTALL_LIBDIR}/rover RENAME libonnxruntime.so.1)
  set(ROVER_INSTALLED_RUNTIME
    "\${rover_PREFIX}/${CMAKE_INSTALL_LIBDIR}/rover/libonnxruntime.so.1")
endif()

if(TARGET rover)
  file(RELATIVE_PATH rover_runtime_path ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR}/rover)
  set_target_properties(rover PROPERTIES INSTALL_RPATH "$ORIGIN/${rover_runtime_path}")
  install(TARGETS rover RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  add_dependencies(rover_install rover)
endif()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/roverConfig.cmake.in
  ${PROJECT_BINARY_DIR}/roverConfig.cmake INSTALL_DESTINATION ${rover_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/roverConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/roverConfig.cmake ${PROJECT_BINARY_DIR}/roverConfigVersion.cmake
  DESTINATION ${rover_cmake_dir})

if(ROVER_BUILD_TESTS AND TARGET rover AND EXISTS ${PROJECT_SOURCE_DIR}/examples/minimal/main.cc)
  # Not by a generator expression: the list of sanitizers has commas.
  set(rover_sanitize_flags "")
  if(ROVER_SANITIZE)
    set(rover_sanitize_flags -fsanitize=${ROVER_SANITIZE})
  endif()
  add_test(NAME install.find_package COMMAND ${CMAKE_COMMAND} -DBUILD=${PROJECT_BINARY_DIR}
    -DSOURCE=${PROJECT_SOURCE_DIR} -DWORK=${PROJECT_BINARY_DIR}/install-test
    -DFLAGS=${rover_sanitize_flags} -P ${PROJECT_SOURCE_DIR}/examples/test_install.cmake)
  set_tests_properties(install.find_package PROPERTIES TIMEOUT 600)
endif()
