#include "core/integrate/method.h"

#include "core/integrate/dop853.h"
#include "core/integrate/dopri5.h"
#include "core/integrate/generalized_alpha.h"
#include "core/integrate/radau.h"

#include <stdexcept>

namespace ffrobot {

namespace {

ImplicitSystem &as_implicit(OdeSystem &system) {
  if (auto *implicit = dynamic_cast<ImplicitSystem *>(&system))
    return *implicit;
  throw std::invalid_argument(
      "integrator: expected dopri5 or dop853, the explicit ones, for a system that gives no Newton "
      "matrix; found an implicit one");
}

} // namespace

std::unique_ptr<Method> make_method(const MethodChoice &choice, OdeSystem &system) {
  switch (choice.kind) {
  case MethodKind::dopri5:
    return std::make_unique<Dopri5>(system);
  case MethodKind::dop853:
    return std::make_unique<Dop853>(system);
  case MethodKind::radau:
    return std::make_unique<Radau>(as_implicit(system));
  case MethodKind::generalized_alpha:
    return std::make_unique<GeneralizedAlpha>(as_implicit(system), choice.spectral_radius);
  }
  return nullptr;
}

} // namespace ffrobot
