// Python's `_core` of a portable build: loads, from the library beside this one, the variant of the compiled core that
// suits this processor best, and hands Python that in its own place.
//
// Variants are whole libraries: Eigen's templates, compiled for two processors, may not meet in one.
#include <Python.h>

#include <cstdlib>
#include <dlfcn.h>
#include <string>

namespace {

// FFROBOT_CORE takes another than the suitable one, for measurements and tests.
std::string variant() {
  if (const char *asked = std::getenv("FFROBOT_CORE"); asked && *asked)
    return asked;
  __builtin_cpu_init();
  return __builtin_cpu_supports("x86-64-v3") ? "v3" : "baseline";
}

} // namespace

PyMODINIT_FUNC PyInit__core() {
  Dl_info self;
  dladdr(reinterpret_cast<void *>(&PyInit__core), &self);
  const std::string name = "_core";
  std::string path = self.dli_fname;
  path.insert(path.rfind(name) + name.size(), "_" + variant());

  void *library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  void *init = library ? dlsym(library, "PyInit__core") : nullptr;
  if (!init) {
    PyErr_SetString(PyExc_ImportError, dlerror());
    return nullptr;
  }
  return reinterpret_cast<PyObject *(*)()>(init)();
}
