// SPDX-License-Identifier: MIT
// How this extension was compiled; `sdftrack info` prints it.
#include "array.h"
#include "base/isa.h"

namespace sdftrack::bindings {

namespace {

std::string compiler_name() {
#if defined(__clang__)
  return std::string("clang ") + __clang_version__;
#elif defined(__GNUC__)
  return std::string("gcc ") + __VERSION__;
#elif defined(_MSC_VER)
  return "msvc " + std::to_string(_MSC_VER);
#else
  return "unknown";
#endif
}

std::vector<std::string> isas() {
  std::vector<std::string> names;
  for (const Isa isa : supported_isas()) names.push_back(isa_name(isa));
  return names;
}

}  // namespace

void bind_build(py::module_& m) {
  py::dict build;
  build["compiler"] = compiler_name();
#ifdef NDEBUG
  build["optimised"] = true;
#else
  build["optimised"] = false;
#endif
  m.attr("build") = build;

  m.def("isas", &isas,
        "Instruction sets that this build has code for and this processor runs, slowest first.");
  m.def(
      "isa", [] { return isa_name(used_isa()); },
      "The one in use: the fastest, or the environment variable SDFTRACK_ISA.");
  used_isa();  // reports a wrong name at the import, not during a frame
}

}  // namespace sdftrack::bindings
