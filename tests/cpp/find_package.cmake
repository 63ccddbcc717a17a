# Installs the build at hand, builds the example against that alone, and runs it.
# cmake -DBUILD=folder -DSOURCE=folder -DWORK=folder -DEIGEN_DIR=folder -DCOMPILER=name -P find_package.cmake
file(REMOVE_RECURSE ${WORK})
foreach(step
    "${CMAKE_COMMAND};--install;${BUILD};--component;development;--prefix;${WORK}/installed"
    "${CMAKE_COMMAND};-S;${SOURCE};-B;${WORK}/build;-DCMAKE_BUILD_TYPE=Release;-DCMAKE_CXX_COMPILER=${COMPILER};-Dsdftrack_ROOT=${WORK}/installed;-DEigen3_DIR=${EIGEN_DIR}"
    "${CMAKE_COMMAND};--build;${WORK}/build"
    "${WORK}/build/track_sphere")
  execute_process(COMMAND ${step} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
