// Pinocchio's articulated-body algorithm of a rigid chain of 6 revolute joints: `REPETITIONS` prints microseconds of
// the fastest of 20 rounds, in axes of the world and of the bodies. How it is compiled: docs/developer/kernel.md.
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>

int main(int, char **given) {
  pinocchio::Model model;
  pinocchio::JointIndex parent = 0;
  for (int i = 0; i < 6; ++i) {
    parent = model.addJoint(parent, pinocchio::JointModelRZ(), pinocchio::SE3::Random(), "joint" + std::to_string(i));
    model.appendBodyToJoint(parent, pinocchio::Inertia::Random());
  }
  pinocchio::Data data(model);
  const Eigen::VectorXd q = Eigen::VectorXd::Random(6), v = Eigen::VectorXd::Random(6), tau = Eigen::VectorXd::Zero(6);
  const int repetitions = std::atoi(given[1]);
  for (const auto convention : {pinocchio::Convention::WORLD, pinocchio::Convention::LOCAL}) {
    double fastest = 1e9;
    for (int round = 0; round < 20; ++round) {
      const auto start = std::chrono::steady_clock::now();
      for (int i = 0; i < repetitions; ++i)
        pinocchio::aba(model, data, q, v, tau, convention);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      fastest = std::min(fastest, 1e6 * seconds / repetitions);
    }
    std::printf("%.4f\n", fastest);
  }
}
