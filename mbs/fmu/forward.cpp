// FMI 2.0, co-simulation, of the forward motion of a robot in space: the same library for all robots, whose model is in
// resources/model.bin (core/forward/forward_motion.h). Value references count inputs, then outputs. Inputs are held
// over a communication step.
#include "core/forward/forward_motion.h"
#include "fmu/fmi2.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

using namespace ffrobot;

namespace {

struct Instance {
  std::string name;
  const fmi2CallbackFunctions *callbacks;
  ForwardModel model;
  std::unique_ptr<ForwardMotion> motion;
};

fmi2Status fail(const fmi2CallbackFunctions *callbacks, const std::string &name, const std::string &message) {
  std::string format; // the message is one of printf
  for (const char c : message)
    format += c == '%' ? "%%" : std::string(1, c);
  if (callbacks && callbacks->logger)
    callbacks->logger(callbacks->componentEnvironment, name.c_str(), fmi2Error, "logStatusError", format.c_str());
  return fmi2Error;
}
fmi2Status fail(fmi2Component c, const std::string &message) {
  const auto *instance = static_cast<const Instance *>(c);
  return fail(instance->callbacks, instance->name, message);
}

// What `work` returns of an instance; its exceptions are messages that begin with the name of the function.
template <class Work> fmi2Status guarded(fmi2Component c, const char *function, Work work) {
  try {
    return work(*static_cast<Instance *>(c));
  } catch (const std::exception &error) {
    return fail(c, std::string(function) + ": " + error.what());
  }
}

int digit(char c) { return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c - 'A' + 10; }

// The folder that a URI of the scheme file names (RFC 8089): "file:/x", "file:///x", with %-escapes.
std::string folder_of(const std::string &uri) {
  std::string escaped = uri;
  if (escaped.rfind("file:", 0) == 0)
    escaped.erase(0, 5);
  if (escaped.rfind("//", 0) == 0)
    escaped.erase(0, std::min(escaped.find('/', 2), escaped.size()));
  std::string path;
  for (std::size_t i = 0; i < escaped.size(); ++i)
    if (escaped[i] == '%' && i + 2 < escaped.size()) {
      path += static_cast<char>(16 * digit(escaped[i + 1]) + digit(escaped[i + 2]));
      i += 2;
    } else {
      path += escaped[i];
    }
  return path;
}

// Not by streams of the C++ library, which would make the library half as large again: all locales come with them.
std::string bytes_in(const std::string &path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE *)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file)
    throw std::runtime_error("expected the file " + path + " of the FMU, found none");
  std::string bytes;
  char part[4096];
  while (const std::size_t count = std::fread(part, 1, sizeof part, file.get()))
    bytes.append(part, count);
  return bytes;
}

ForwardModel model_in(const std::string &uri) {
  const std::string path = folder_of(uri) + "/model.bin", bytes = bytes_in(path);
  try {
    return forward_model_of(bytes);
  } catch (const std::exception &error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

const char *in_words(IntegrationStatus status) {
  switch (status) {
  case IntegrationStatus::completed:
    return "completed";
  case IntegrationStatus::step_underflow:
    return "no step size meets the tolerance";
  case IntegrationStatus::too_many_steps:
    return "too many steps";
  case IntegrationStatus::interrupted:
    return "interrupted";
  case IntegrationStatus::diverged:
    return "the motion diverged";
  }
  return "unknown";
}

} // namespace

// ---- life of an instance ----

FMI2_EXPORT const char *fmi2GetTypesPlatform() { return "default"; }
FMI2_EXPORT const char *fmi2GetVersion() { return "2.0"; }

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *callbacks, fmi2Boolean, fmi2Boolean) {
  const std::string called = name ? name : "";
  try {
    if (type != fmi2CoSimulation)
      throw std::runtime_error("expected co-simulation, found model exchange");
    auto instance = std::make_unique<Instance>();
    instance->name = called, instance->callbacks = callbacks;
    instance->model = model_in(resources ? resources : "");
    if (!guid || instance->model.guid != guid)
      throw std::runtime_error("expected the guid " + instance->model.guid +
                               " of modelDescription.xml, found another: resources/model.bin is of another export");
    instance->motion = std::make_unique<ForwardMotion>(instance->model);
    return instance.release();
  } catch (const std::exception &error) {
    fail(callbacks, called, std::string("fmi2Instantiate: ") + error.what());
    return nullptr;
  }
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) { delete static_cast<Instance *>(c); }

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean, size_t, const fmi2String[]) { return fmi2OK; }

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component, fmi2Boolean, fmi2Real, fmi2Real, fmi2Boolean, fmi2Real) {
  return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component) { return fmi2OK; }
FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component) { return fmi2OK; }
FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component) { return fmi2OK; }

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c) {
  return guarded(c, "fmi2Reset", [](Instance &instance) {
    instance.motion = std::make_unique<ForwardMotion>(instance.model);
    return fmi2OK;
  });
}

// ---- values ----

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real value[]) {
  return guarded(c, "fmi2GetReal", [&](Instance &instance) {
    ForwardMotion &motion = *instance.motion;
    const std::size_t n_u = motion.inputs().size();
    for (size_t i = 0; i < n; ++i) {
      if (r[i] >= n_u + motion.output_count())
        throw std::runtime_error("expected a value reference of modelDescription.xml, found another");
      value[i] = r[i] < n_u ? motion.inputs()[r[i]] : motion.outputs()[r[i] - n_u];
    }
    return fmi2OK;
  });
}

FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real value[]) {
  auto &inputs = static_cast<Instance *>(c)->motion->inputs();
  for (size_t i = 0; i < n; ++i) {
    if (r[i] >= inputs.size() || !std::isfinite(value[i]))
      return fail(c, "fmi2SetReal: expected a finite value of an input, found something else");
    inputs[r[i]] = value[i];
  }
  return fmi2OK;
}

// There are real variables only.
#define NONE_OF(type)                                                                                                  \
  FMI2_EXPORT fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference[], size_t n, fmi2##type[]) {          \
    return n ? fail(c, "expected real variables, found a reference to one of type " #type) : fmi2OK;                   \
  }                                                                                                                    \
  FMI2_EXPORT fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference[], size_t n, const fmi2##type[]) {    \
    return n ? fail(c, "expected real variables, found a reference to one of type " #type) : fmi2OK;                   \
  }
NONE_OF(Integer)
NONE_OF(Boolean)
NONE_OF(String)

// ---- co-simulation ----

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean) {
  return guarded(c, "fmi2DoStep", [&](Instance &instance) {
    if (!(h >= 0 && std::isfinite(h) && std::isfinite(time)))
      throw std::runtime_error("expected a step of zero or more seconds");
    const auto status = h == 0 ? IntegrationStatus::completed : instance.motion->step(time, h);
    if (status != IntegrationStatus::completed)
      throw std::runtime_error("at t = " + std::to_string(time) + " s: " + in_words(status));
    return fmi2OK;
  });
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
  return fail(c, "fmi2CancelStep: no step is left to finish later");
}

FMI2_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference[], size_t n,
                                                   const fmi2Integer[], const fmi2Real[]) {
  return n ? fail(c, "fmi2SetRealInputDerivatives: inputs are held over a step") : fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference[], size_t n,
                                                    const fmi2Integer[], fmi2Real[]) {
  return n ? fail(c, "fmi2GetRealOutputDerivatives: outputs come without derivatives") : fmi2OK;
}

#define NO_STATUS(name, type)                                                                                          \
  FMI2_EXPORT fmi2Status name(fmi2Component, const fmi2StatusKind, type *) { return fmi2Discard; }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetRealStatus, fmi2Real)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)

// ---- states that are kept ----

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  return guarded(c, "fmi2GetFMUstate", [&](Instance &instance) {
    ForwardState now = instance.motion->state();
    if (*state) // of an earlier call, to be written over
      *static_cast<ForwardState *>(*state) = std::move(now);
    else
      *state = new ForwardState(std::move(now));
    return fmi2OK;
  });
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  return guarded(c, "fmi2SetFMUstate", [&](Instance &instance) {
    if (!state)
      throw std::runtime_error("expected a state of fmi2GetFMUstate, found none");
    instance.motion->bring_back(*static_cast<const ForwardState *>(state));
    return fmi2OK;
  });
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate *state) {
  if (state) {
    delete static_cast<ForwardState *>(*state);
    *state = nullptr;
  }
  return fmi2OK;
}

// ---- what modelDescription.xml says that there is not ----

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference[], size_t,
                                                    const fmi2ValueReference[], size_t, const fmi2Real[], fmi2Real[]) {
  return fail(c, "fmi2GetDirectionalDerivative: there are none");
}
FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate, size_t *) {
  return fail(c, "fmi2SerializedFMUstateSize: states are kept in memory alone");
}
FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate, fmi2Byte[], size_t) {
  return fail(c, "fmi2SerializeFMUstate: states are kept in memory alone");
}
FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte[], size_t, fmi2FMUstate *) {
  return fail(c, "fmi2DeSerializeFMUstate: states are kept in memory alone");
}
