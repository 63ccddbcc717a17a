# The loops over pixels exist once per instruction set, and the one to use is chosen at run time. Each source is
# made in the build folder from instruction_set.cpp.in.
set(lanes_baseline float)
set(lanes_header_baseline base/lane.h)
set(lanes_avx2 "Pack<8>")
set(lanes_header_avx2 base/pack.h)
set(lanes_avx512 "Pack<16>")
set(lanes_header_avx512 base/pack.h)
set(packs_in_baseline contour superpixels)  # folders whose loops are packs there too, where every processor has them
set(options_baseline "")
set(pack_warnings -Wno-psabi)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  list(APPEND pack_warnings -Wno-maybe-uninitialized)  # of GCC 12 about its own intrinsics
endif()
set(options_avx2 -mavx2 ${pack_warnings})
set(options_avx512 -mavx512f -mavx512bw -mavx512dq -mavx512vl -mprefer-vector-width=512 ${pack_warnings})

# What threads share does not depend on the instruction set: ThreadSanitizer gets the baseline alone.
if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang" AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64"
   AND NOT "thread" IN_LIST SDFTRACK_SANITIZE)
  set(SDFTRACK_X86_SETS ON)
else()
  set(SDFTRACK_X86_SETS OFF)
endif()

# `loops`: the header with the loops; `name`: of the sources, <folder>/<name>_<set>.cpp; further arguments: the
# sets beside the baseline.
function(sdftrack_instruction_sets target loops name)
  get_filename_component(folder ${loops} DIRECTORY)
  set(sets baseline)
  if(SDFTRACK_X86_SETS)
    list(APPEND sets ${ARGN})
  endif()
  foreach(set IN LISTS sets)
    set(lanes ${lanes_${set}})
    set(lanes_header ${lanes_header_${set}})
    if(set STREQUAL "baseline" AND folder IN_LIST packs_in_baseline)
      set(lanes BaselineLanes)
      set(lanes_header base/baseline_lanes.h)
    endif()
    set(source ${CMAKE_CURRENT_BINARY_DIR}/${folder}/${name}_${set}.cpp)
    configure_file(${CMAKE_CURRENT_SOURCE_DIR}/cmake/instruction_set.cpp.in ${source} @ONLY)
    target_sources(${target} PRIVATE ${source})
    set_source_files_properties(${source} PROPERTIES
      COMPILE_OPTIONS "${options_${set}};${sanitize_less_options}" SKIP_PRECOMPILE_HEADERS ON SKIP_UNITY_BUILD_INCLUSION ON)
  endforeach()
endfunction()
