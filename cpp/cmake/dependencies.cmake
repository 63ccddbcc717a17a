# Every third-party name, version and fallback of the C++ build. Nothing is downloaded here.

find_package(Threads REQUIRED)

if(SDFTRACK_PYTHON)
  find_package(Python 3.11 REQUIRED COMPONENTS Interpreter Development.Module)
  find_package(pybind11 3.0 CONFIG REQUIRED)
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

if(SDFTRACK_TESTS)
  find_package(GTest REQUIRED)
endif()
