#include "core/integrate/method.h"

#include "core/integrate/dop853.h"
#include "core/integrate/dopri5.h"
#include "core/integrate/generalized_alpha.h"
#include "core/integrate/radau.h"

namespace ffrobot {

std::unique_ptr<Method> make_method(const MethodChoice &choice, OdeSystem &system) {
  switch (choice.kind) {
  case MethodKind::dopri5:
    return std::make_unique<Dopri5>(system);
  case MethodKind::dop853:
    return std::make_unique<Dop853>(system);
  case MethodKind::radau:
    return std::make_unique<Radau>(system);
  case MethodKind::generalized_alpha:
    return std::make_unique<GeneralizedAlpha>(system, choice.spectral_radius);
  }
  return nullptr;
}

} // namespace ffrobot
