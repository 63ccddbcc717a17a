# Installs the build at hand, builds the examples against that alone, runs one, and compares the others with Python
# (PYTHON, where it has the package).
# cmake -DBUILD=folder -DSOURCE=folder -DWORK=folder -DEIGEN_DIR=folder -DCOMPILER=name
# -DPYTHON=path -P find_package.cmake
file(REMOVE_RECURSE ${WORK})
foreach(step
    "${CMAKE_COMMAND};--install;${BUILD};--component;development;--prefix;${WORK}/installed"
    "${CMAKE_COMMAND};-S;${SOURCE};-B;${WORK}/build;-DCMAKE_BUILD_TYPE=Release;-DCMAKE_CXX_COMPILER=${COMPILER};-Dsdftrack_ROOT=${WORK}/installed;-DEigen3_DIR=${EIGEN_DIR}"
    "${CMAKE_COMMAND};--build;${WORK}/build"
    "${WORK}/build/several")
  execute_process(COMMAND ${step} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
if(PYTHON)
  execute_process(COMMAND ${PYTHON} ${CMAKE_CURRENT_LIST_DIR}/same_answers.py ${WORK}/build ${WORK}
    COMMAND_ERROR_IS_FATAL ANY)
endif()
