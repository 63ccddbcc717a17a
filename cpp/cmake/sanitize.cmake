# Sanitizers for everything that is compiled here: SDFTRACK_SANITIZE="address;undefined" or "thread". The first
# report ends the program. -O1: loops as slow as without optimization would make the tests take hours.
if(NOT SDFTRACK_SANITIZE)
  return()
endif()
foreach(name IN LISTS SDFTRACK_SANITIZE)
  if(NOT name MATCHES "^(address|undefined|thread)$")
    message(FATAL_ERROR "SDFTRACK_SANITIZE: expected address, undefined or thread, got ${name}")
  endif()
endforeach()
set(sanitizers ${SDFTRACK_SANITIZE})
if("undefined" IN_LIST sanitizers)
  list(APPEND sanitizers float-cast-overflow)  # not in `undefined`; a division by zero is meant: IEEE 754 defines it
endif()
list(JOIN sanitizers "," sanitizers)
add_compile_options(-fsanitize=${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer -O1 -g1)
add_compile_definitions(_GLIBCXX_ASSERTIONS)
add_link_options(-fsanitize=${sanitizers})

# For loops of one instruction set, which are inlined into functions with ten thousands of temporaries (ten minutes for a
# file otherwise), and for bindings and tests: without the checks that each temporary lives, and without those of pointers
# that AddressSanitizer makes as well.
if("address" IN_LIST SDFTRACK_SANITIZE)
  set(sanitize_less_options -fno-sanitize-address-use-after-scope
    -fno-sanitize=null,alignment,object-size,vptr,nonnull-attribute,returns-nonnull-attribute)
endif()
