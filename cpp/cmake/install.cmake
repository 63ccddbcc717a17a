# What `cmake --install <build> --component development` puts down: the library, its public headers, and the CMake package
# that find_package(sdftrack) reads. The Python package is the component `python` and has none of these.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set_target_properties(sdftrack_core PROPERTIES EXPORT_NAME core)
install(TARGETS sdftrack_core EXPORT sdftrackTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(FILES sdftrack/camera.h sdftrack/reconstructor.h sdftrack/shape.h sdftrack/tracker.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sdftrack COMPONENT development)
if(SDFTRACK_IO)
  set_target_properties(sdftrack_io PROPERTIES EXPORT_NAME io)
  install(TARGETS sdftrack_io EXPORT sdftrackIoTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(FILES sdftrack/sequence.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sdftrack COMPONENT development)
endif()
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/sdftrack)
install(EXPORT sdftrackTargets NAMESPACE sdftrack:: DESTINATION ${package_folder} COMPONENT development)
if(SDFTRACK_IO)
  install(EXPORT sdftrackIoTargets NAMESPACE sdftrack:: DESTINATION ${package_folder} COMPONENT development)
endif()
configure_package_config_file(${CMAKE_CURRENT_SOURCE_DIR}/cmake/sdftrackConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/sdftrackConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/sdftrackConfigVersion.cmake
  VERSION ${SDFTRACK_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/sdftrackConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/sdftrackConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT development)
