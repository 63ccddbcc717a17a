# The loops over pixels for another processor: compiled by a cross compiler, run by an emulator, compared with the
# machine at hand bit by bit. cmake -DHERE=program -DSOURCE=folder -DOPS=ops_baseline.cpp -DBUILD=folder -DEIGEN=folder -P aarch64.cmake
find_program(compiler NAMES aarch64-linux-gnu-g++)
find_program(emulator NAMES qemu-aarch64 qemu-aarch64-static)
if(NOT compiler OR NOT emulator)
  message("SKIPPED: needs aarch64-linux-gnu-g++ and qemu-aarch64 (Debian: g++-aarch64-linux-gnu, qemu-user)")
  return()
endif()
set(program ${BUILD}/loop_bits_aarch64)
execute_process(COMMAND ${compiler} -std=c++20 -O2 -ffp-contract=off -fno-math-errno -static -I ${SOURCE}/cpp -isystem ${EIGEN}
    ${SOURCE}/tests/cpp/loop_bits.cpp ${OPS} ${SOURCE}/cpp/base/rigid.cpp -o ${program}
  RESULT_VARIABLE failed ERROR_VARIABLE errors)
if(failed)
  message(FATAL_ERROR "cross compilation failed:\n${errors}")
endif()
execute_process(COMMAND ${emulator} ${program} OUTPUT_VARIABLE there RESULT_VARIABLE failed)
execute_process(COMMAND ${HERE} OUTPUT_VARIABLE here)
if(failed OR NOT there STREQUAL here OR here STREQUAL "")
  message(FATAL_ERROR "aarch64 computes other bits.\nhere:\n${here}\nthere:\n${there}")
endif()
message("the same bits:\n${here}")
