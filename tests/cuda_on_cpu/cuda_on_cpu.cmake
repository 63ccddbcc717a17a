# The stand-in in place of the CUDA runtime: its sources, and the .cu files as C++.
set(cuda_on_cpu_folder ${CMAKE_CURRENT_LIST_DIR})
function(sdftrack_cuda_on_cpu target)
  file(GLOB sources CONFIGURE_DEPENDS ${cuda_on_cpu_folder}/*.cpp)
  set_source_files_properties(${ARGN} PROPERTIES LANGUAGE CXX COMPILE_OPTIONS
    "-xc++;-include;${cuda_on_cpu_folder}/cuda_runtime.h;-Wno-unknown-pragmas")
  target_sources(${target} PRIVATE ${sources} ${ARGN})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${cuda_on_cpu_folder}>)
  target_compile_definitions(${target} PUBLIC SDFTRACK_CUDA_ON_CPU)
endfunction()
