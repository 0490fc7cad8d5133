// Motions of planar systems that are wholly prescribed: mbs/core/analysis/prescribed_motion.h.
#include "core/analysis/tree_outputs.h"
#include "core/analysis/tree_replay.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <limits>
#include <utility>

#include "bindings/recursion/recursion.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

// p, p_dot and p_ddot (T, n) at times (T)
struct Modes {
  const RowMajorMatrix &p, &p_dot, &p_ddot;

  ModalMotion operator[](std::size_t i) const {
    const auto row = static_cast<Index>(i);
    return {p.row(row), p_dot.row(row), p_ddot.row(row)};
  }
};

Modes checked(const PrescribedMotion &motion, const std::vector<double> &times, const RowMajorMatrix &p,
              const RowMajorMatrix &p_dot, const RowMajorMatrix &p_ddot) {
  for (const RowMajorMatrix *of : {&p, &p_dot, &p_ddot}) {
    check_size("times of modes", of->rows(), static_cast<Index>(times.size()));
    check_size("modes", of->cols(), motion.both().system.n_modes());
  }
  return {p, p_dot, p_ddot};
}

// (q (T, n_q), forces that are left on modes (T, n)); NaN where no position is found
std::pair<RowMajorMatrix, RowMajorMatrix> left_on_modes(PrescribedMotion &motion, const std::vector<double> &times,
                                                        const RowMajorMatrix &p, const RowMajorMatrix &p_dot,
                                                        const RowMajorMatrix &p_ddot, const RowMajorMatrix &near) {
  const Modes modes = checked(motion, times, p, p_dot, p_ddot);
  const Index n_q = motion.both().tree.n_q;
  check_size("near", near.cols(), n_q);
  const bool follows = near.rows() == 1;
  if (!follows)
    check_size("near", near.rows(), p.rows());
  constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
  RowMajorMatrix q = RowMajorMatrix::Constant(p.rows(), n_q, NaN);
  RowMajorMatrix left = RowMajorMatrix::Constant(p.rows(), p.cols(), NaN);
  VectorXd last = near.row(0);
  double found_at = NaN;
  motion.start_at(last);
  const auto move = [&](std::size_t i) {
    if (follows)
      return motion.move(times[i], modes[i]);
    if (times[i] != found_at) {
      motion.start_at(near.row(static_cast<Index>(i)));
      if (motion.move(times[i], modes[i]))
        return true;
    }
    motion.start_at(last); // links that are bent far are nearer to that
    return motion.move(times[i], modes[i]);
  };
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (move(i)) {
      const auto row = static_cast<Index>(i);
      motion.balance();
      last = motion.state().head(n_q);
      found_at = times[i];
      q.row(row) = last.transpose();
      left.row(row) = motion.left().transpose();
    } else if (follows)
      break;
  }
  return {q, left};
}

Run prescribed_outputs(PrescribedMotion &motion, const std::vector<double> &times, const RowMajorMatrix &p,
                       const RowMajorMatrix &p_dot, const RowMajorMatrix &p_ddot, const VectorXd &q) {
  const Modes modes = checked(motion, times, p, p_dot, p_ddot);
  check_size("q", q.size(), motion.both().tree.n_q);
  motion.start_at(q);
  TreeOutputs outputs(motion.both(), times.size(), times.front(), motion.state().data(), nullptr);
  std::size_t reached = 0;
  for (; reached < times.size() && motion.move(times[reached], modes[reached]); ++reached) {
    motion.balance();
    outputs(reached, motion);
  }
  return {{}, outputs.take(reached), {}};
}

} // namespace

void bind_prescribed(nb::module_ &m) {
  nb::class_<PrescribedMotion>(m, "PrescribedMotion", "Modes as they are told, joints as rows have it.")
      .def(nb::init<const SystemOnTree &, VectorXd>(), "both"_a, "q"_a, nb::keep_alive<1, 2>(),
           "q (n_q) of the tree: a posture to start from.")
      .def(
          "left_on_modes", &left_on_modes, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a, "near"_a,
          "(q (T, n_q), forces on modes (T, n)) that neither motors, or rows without any, nor loads supply, with modes "
          "of all\nbodies (T, n), from postures near (T, n_q), or each from the last, the first near (1, n_q); NaN "
          "where none is found.")
      .def("outputs", &prescribed_outputs, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a, "q"_a,
           "What a run reports, as far as positions were found, the first from q (n_q).");
  nb::class_<PrescribedActuation, ActuationSource>(m, "PrescribedActuation", "Solved anew at every time.")
      .def(nb::init<PrescribedMotion &, std::vector<ModalShape>, VectorXd>(), "motion"_a, "shape"_a, "q"_a,
           nb::keep_alive<1, 2>());
  nb::class_<RedefinedMotion, PrescribedMotion>(m, "RedefinedMotion",
                                                "With the motors of the motion that follows a path.")
      .def(nb::init<const SystemOnTree &, const SystemOnTree &, VectorXd, double, std::vector<TimeFunction>>(),
           "driven"_a, "path"_a, "q"_a, "factor"_a, "offset"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>());
}
