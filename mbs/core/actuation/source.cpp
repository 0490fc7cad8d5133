#include "core/actuation/source.h"

namespace ffrobot {

ActuationSource::ActuationSource(const System &system) {
  for (const auto &body : system.bodies)
    modal_force_.emplace_back(Eigen::VectorXd::Zero(body.modes()));
}

} // namespace ffrobot
