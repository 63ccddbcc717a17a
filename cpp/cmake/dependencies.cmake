# Every third-party name, version and fallback of the C++ build. Nothing is downloaded here.

# Headers of `target` from a copy in the build folder, files that have not changed left as they are: pip
# unpacks them into a new folder for each build, which would have everything compiled anew each time.
function(sdftrack_keep_headers target folder) # folder: what to copy of the target's include folders
  get_target_property(include_folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
  foreach(include_folder IN LISTS include_folders)
    if(NOT IS_DIRECTORY "${include_folder}/${folder}")
      continue()
    endif()
    set(kept "${PROJECT_BINARY_DIR}/headers/${folder}")
    file(GLOB_RECURSE headers RELATIVE "${include_folder}" "${include_folder}/${folder}/*")
    foreach(header IN LISTS headers)
      get_filename_component(header_folder "${kept}/${header}" DIRECTORY)
      file(MAKE_DIRECTORY "${header_folder}")
      file(COPY_FILE "${include_folder}/${header}" "${kept}/${header}" ONLY_IF_DIFFERENT)
    endforeach()
    list(REMOVE_ITEM include_folders "${include_folder}")
    list(PREPEND include_folders "${kept}")
    set_target_properties(${target} PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES "${include_folders}"
      INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${kept}")
    return()
  endforeach()
  message(FATAL_ERROR "${target}: no folder ${folder} in ${include_folders}")
endfunction()

find_package(Threads REQUIRED)

if(SDFTRACK_PYTHON)
  find_package(Python 3.11 REQUIRED COMPONENTS Interpreter Development.Module)
  find_package(pybind11 3.0 CONFIG REQUIRED)
  sdftrack_keep_headers(pybind11::pybind11_headers pybind11)
else()
  find_package(Python 3.11 COMPONENTS Interpreter)
endif()

# Eigen's headers: from the Python package cmeel-eigen (a build requirement of pyproject.toml), which
# keeps its CMake files under cmeel.prefix of the folder that it is installed in; else the system's.
if(Python_EXECUTABLE)
  execute_process(
    COMMAND ${Python_EXECUTABLE} -c
            "import sys, pathlib; print(';'.join(str(p) for d in sys.path if (p := pathlib.Path(d) / 'cmeel.prefix').is_dir()))"
    OUTPUT_VARIABLE eigen_prefixes
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  list(APPEND CMAKE_PREFIX_PATH ${eigen_prefixes})
endif()
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
sdftrack_keep_headers(Eigen3::Eigen Eigen)

if(SDFTRACK_IO)
  find_package(OpenCV 4 REQUIRED COMPONENTS core imgproc imgcodecs)
endif()

if(SDFTRACK_TESTS)
  find_package(GTest REQUIRED)
endif()
