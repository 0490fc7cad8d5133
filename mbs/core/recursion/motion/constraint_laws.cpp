#include "core/recursion/motion/constraint_laws.h"

namespace ffrobot::recursion {

namespace {

std::vector<TimeFunction> laws_of(const Scene &scene, std::size_t equations) {
  std::vector<TimeFunction> laws;
  for (const Target &target : scene.targets)
    laws.push_back(target.law);
  laws.resize(equations, Constant(0));
  return laws;
}

} // namespace

std::vector<Jet> targets_at(const Scene &scene, double t) {
  std::vector<Jet> found;
  for (const Target &target : scene.targets)
    found.push_back(target(t));
  return found;
}

void take_off(const std::vector<Jet> &targets, const std::vector<Constraint> &constraints, VectorXd &value,
              VectorXd &rate) {
  for (std::size_t r = 0; r < targets.size(); ++r) {
    double &of_row = value[r];
    of_row = constraints[r].apart(of_row, targets[r].value);
    rate[r] -= targets[r].rate;
  }
}

ConstraintLaws::ConstraintLaws(const Scene &scene, std::size_t equations)
    : laws_(laws_of(scene, equations)), sign_(VectorXd::Ones(equations)) {
  for (std::size_t r = 0; r < scene.targets.size(); ++r)
    sign_[r] = scene.targets[r].sign;
}

void ConstraintLaws::look_up(double t) {
  now_ = std::ranges::find(times_, t) - times_.begin();
  if (now_ == times_.size())
    find(&t, 1), now_ = 0;
}

void ConstraintLaws::find(const double *times, int count) {
  times_.assign(times, times + count);
  laws_.find(times, count), laws_.accelerations(sign_.data(), accelerations_);
  next_ = 0;
}

} // namespace ffrobot::recursion
