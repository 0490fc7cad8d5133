// Motions that are wholly prescribed, and what motors do in place of what holds them: mbs/core/recursion/
// prescribed_motion.h and motors.h.
#include "core/recursion/inverse/prescribed_motion.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/known_motion.h"

namespace {

// p, p_dot and p_ddot (T, n) at times (T)
struct Modes {
  const std::vector<double> &times;
  const RowMajor &p, &p_dot, &p_ddot;

  ModalMotion operator[](std::size_t i) const {
    const Index row = i;
    return {p.row(row), p_dot.row(row), p_ddot.row(row)};
  }
  void check(Index n) const {
    for (const RowMajor *of : {&p, &p_dot, &p_ddot}) {
      check_size("times of modes", of->rows(), times.size());
      check_size("modes", of->cols(), n);
    }
  }
};

// At states q, v, a: forces `required` M a - Q, multipliers, and what motors do in place of both
struct Prescribed {
  RowMajor q, v, a, required, multipliers, tau, left, loops;
};

// each(i) after balance() at every time with a position: from postures near (T, n_q), or each from the last, the first
// near (1, n_q), up to the first time without one.
template <class Space, class Each>
void at_positions(PrescribedMotion<Space> &motion, const Modes &modes, const RowMajor &near, const Each &each) {
  const Index n_q = motion.driven().mechanism.n_q;
  modes.check(motion.modes());
  check_size("near", near.cols(), n_q);
  const bool follows = near.rows() == 1;
  if (!follows)
    check_size("near", near.rows(), modes.p.rows());
  if (modes.times.empty())
    return;
  VectorXd last = near.row(0);
  double found_at = std::numeric_limits<double>::quiet_NaN();
  motion.start_at(last);
  for (std::size_t i = 0; i < modes.times.size(); ++i) {
    const double t = modes.times[i];
    if (!follows && t != found_at)
      motion.start_at(near.row(i));
    else if (!follows)
      motion.start_at(last);
    bool is_found = motion.move(t, modes[i]);
    if (!is_found && (follows || t != found_at)) { // links that are bent far are nearer to the last posture
      motion.start_at(last);
      is_found = motion.move(t, modes[i]);
    }
    if (is_found) {
      motion.balance();
      last = motion.state().head(n_q);
      found_at = t;
      each(i);
    } else if (follows)
      return;
  }
}

RowMajor nothing(Index rows, Index columns) {
  return RowMajor::Constant(rows, columns, std::numeric_limits<double>::quiet_NaN());
}

template <class Space>
std::pair<RowMajor, RowMajor> left_on_modes(PrescribedMotion<Space> &motion, const std::vector<double> &times,
                                            const RowMajor &p, const RowMajor &p_dot, const RowMajor &p_ddot,
                                            const RowMajor &near) {
  const Index T = p.rows(), n_q = motion.driven().mechanism.n_q;
  RowMajor q = nothing(T, n_q), left = nothing(T, p.cols());
  at_positions(motion, {times, p, p_dot, p_ddot}, near, [&](Index i) {
    q.row(i) = motion.state().head(n_q).transpose();
    left.row(i) = motion.left().transpose();
  });
  return {q, left};
}

// M, D, K (T, (n + motors) n) of what is left, and of torques, by p_ddot, p_dot and p
template <class Space>
std::tuple<RowMajor, RowMajor, RowMajor>
derivatives_of(PrescribedMotion<Space> &motion, const std::vector<double> &times, const RowMajor &p,
               const RowMajor &p_dot, const RowMajor &p_ddot, const RowMajor &near) {
  const Index n = p.cols(), rows = n + motion.driven().motors.size();
  RowMajor M = nothing(p.rows(), rows * n), D = M, K = M;
  at_positions(motion, {times, p, p_dot, p_ddot}, near, [&](Index i) {
    const LeftSlopes found = motion.slopes();
    const auto write = [&](const MatrixXd &of, RowMajor &to) { Map<RowMajor>(to.row(i).data(), rows, n) = of; };
    write(found.M, M), write(found.D, D), write(found.K, K);
  });
  return {M, D, K};
}

template <class Space>
Prescribed states_of(PrescribedMotion<Space> &motion, const std::vector<double> &times, const RowMajor &p,
                     const RowMajor &p_dot, const RowMajor &p_ddot, const RowMajor &near) {
  const auto &driven = motion.driven();
  const Index T = p.rows(), n_q = driven.mechanism.n_q, n_v = driven.mechanism.n_v;
  const Index tau = driven.motors.size(), equations = motion.lambda().size();
  const Index loops = std::ranges::count(driven.is_path, 0);
  Prescribed to{nothing(T, n_q),       nothing(T, n_v), nothing(T, n_v), nothing(T, n_v),
                nothing(T, equations), nothing(T, tau), nothing(T, n_v), nothing(T, loops)};
  at_positions(motion, {times, p, p_dot, p_ddot}, near, [&](Index i) {
    to.q.row(i) = motion.state().head(n_q).transpose(), to.v.row(i) = motion.state().tail(n_v).transpose();
    to.a.row(i) = motion.a().transpose(), to.required.row(i) = motion.required().transpose();
    to.multipliers.row(i) = motion.lambda().transpose();
    if (const Motors<Space> *motors = motion.motors()) {
      to.tau.row(i) = motors->tau().transpose(), to.left.row(i) = motors->left().transpose();
      to.loops.row(i) = motors->loops().transpose();
    }
  });
  return to;
}

// each(i, motors, workspace) at postures q (T, n_q); markers that constraint equations follow are where they are at
// `times` (T), if there are any. A posture that comes again, without times, is placed once.
template <class Space, class Each>
void at_postures(const DrivenMechanism<Space> &driven, const std::vector<double> &times, const RowMajor &q,
                 const Each &each) {
  check_size("coordinates", q.cols(), driven.mechanism.n_q);
  Workspace<Space, double> w(driven.mechanism);
  Motors<Space> motors(driven);
  const VectorXd v = VectorXd::Zero(driven.mechanism.n_v);
  const VectorXd target = VectorXd::Zero(driven.mechanism.constraints.size());
  VectorXd a(driven.mechanism.n_v);
  w.keep({});
  for (Index i = 0; i < q.rows(); ++i) {
    if (!times.empty())
      turn_markers(driven.scene, times[i], w);
    if (i == 0 || !times.empty() || q.row(i) != q.row(i - 1)) {
      const auto at = place_all(q.row(i).data(), v.data(), nullptr, w);
      // for the mass matrix of the modes of stiffened bodies, and their rows
      accelerations(at, nullptr, target.data(), a.data());
    }
    each(i, motors, w);
  }
}

template <class Space>
RowMajor path_forces(const DrivenMechanism<Space> &driven, const std::vector<double> &times, const RowMajor &q,
                     const RowMajor &multipliers) {
  check_size("times", times.size(), q.rows());
  check_multipliers(multipliers, q.rows(), driven.mechanism.constraints.size());
  RowMajor found(q.rows(), driven.mechanism.n_v);
  at_postures(driven, times, q, [&](Index i, Motors<Space> &motors, const auto &w) {
    found.row(i) = motors.path_forces(q.row(i).data(), multipliers.row(i).data(), w).transpose();
  });
  return found;
}

template <class Space>
std::vector<RowMajor> path_forces_on_bodies(const DrivenMechanism<Space> &driven, const std::vector<double> &times,
                                            const RowMajor &q, const RowMajor &multipliers) {
  check_size("times", times.size(), q.rows());
  check_multipliers(multipliers, q.rows(), driven.mechanism.constraints.size());
  std::vector<RowMajor> found;
  for (const auto &node : driven.mechanism.nodes)
    found.emplace_back(q.rows(), Space::dim + node.n());
  at_postures(driven, times, q, [&](Index i, Motors<Space> &motors, const auto &w) {
    const auto on_bodies = motors.path_forces_on_bodies(multipliers.row(i).data(), w);
    for (std::size_t k = 0; k < found.size(); ++k)
      found[k].row(i) = on_bodies[k].transpose();
  });
  return found;
}

template <class Space>
std::tuple<RowMajor, RowMajor, RowMajor> split(const DrivenMechanism<Space> &driven, const RowMajor &q,
                                               const RowMajor &wanted) {
  check_size("postures of forces", wanted.rows(), q.rows());
  check_size("forces", wanted.cols(), driven.mechanism.n_v);
  RowMajor tau(q.rows(), driven.motors.size()), left(q.rows(), wanted.cols());
  RowMajor loops(q.rows(), std::ranges::count(driven.is_path, 0));
  at_postures(driven, {}, q, [&](Index i, Motors<Space> &motors, const auto &w) {
    motors.split(q.row(i).data(), wanted.row(i), w);
    tau.row(i) = motors.tau().transpose(), left.row(i) = motors.left().transpose();
    loops.row(i) = motors.loops().transpose();
  });
  return {tau, left, loops};
}

template <class Space>
void make_driven(DrivenMechanism<Space> *made, const Model<Space> &model, const Scene &scene,
                 const std::vector<bool> &is_path) {
  check_scene(model, scene);
  new (made) DrivenMechanism<Space>(model.mechanism, scene, {}, {is_path.begin(), is_path.end()});
  made->check();
}

template <class Space> void bind_driven(nb::module_ &m, const std::string &space) {
  using Driven = DrivenMechanism<Space>;
  nb::class_<Driven>(m, (space + "Driven").c_str(), "A mechanism under its scene, with motors and a path.")
      .def("__init__", &make_driven<Space>, "model"_a, "scene"_a, "is_path"_a, nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 3>(), "is_path: of each constraint equation; others close loops.")
      .def(
          "add_motor",
          [](Driven &d, int coordinate, double sign, bool turns_frames) {
            d.motors.push_back({coordinate, sign, turns_frames});
            d.check();
          },
          "coordinate"_a, "sign"_a, "turns_frames"_a,
          "A motor along `sign` v[coordinate], or between the frames of the bodies there.")
      .def("path_forces", &path_forces<Space>, "times"_a, "q"_a, "multipliers"_a,
           "-C_s^T lambda_s (T, n_v) of the path at postures q (T, n_q), with multipliers (T, constraint equations).")
      .def("path_forces_on_bodies", &path_forces_on_bodies<Space>, "times"_a, "q"_a, "multipliers"_a,
           "The same on each body alone, (T, 6 + n) in 3D: on its frame, in axes of that, and on its modes.")
      .def("split", &split<Space>, "q"_a, "wanted"_a,
           "(tau (T, motors), left (T, n_v), loops (T, constraint equations of loops)): motor torques for generalized "
           "forces\n`wanted` (T, n_v), the part that they and loops leave, and multipliers of the loops.");
}

template <class Space> void bind_motion(nb::module_ &m, const std::string &space) {
  using Motion = PrescribedMotion<Space>;
  using Driven = DrivenMechanism<Space>;
  nb::class_<Motion>(m, (space + "PrescribedMotion").c_str(),
                     "Modes by functions of time, joints by constraint equations.")
      .def(nb::init<Driven, VectorXd>(), "driven"_a, "q"_a, nb::keep_alive<1, 2>(), "q (n_q): a posture to start from.")
      .def_prop_ro(
          "driven", [](const Motion &motion) -> const Driven & { return motion.driven(); },
          nb::rv_policy::reference_internal)
      .def("left_on_modes", &left_on_modes<Space>, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a, "near"_a,
           "(q (T, n_q), forces on modes (T, n)) that neither motors, or constraint equations without any, nor loads "
           "supply,\nwith modes of all bodies (T, n), from postures near (T, n_q), or each from the last, the first "
           "near (1, n_q);\nNaN where none is found.")
      .def("derivatives", &derivatives_of<Space>, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a, "near"_a,
           "(M, D, K), (T, (n + motors) n) each: exact derivatives of these forces, and of torques, by p_ddot, p_dot\n"
           "and p, less what motors that turn frames do beside.")
      .def("motion", &states_of<Space>, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a, "near"_a,
           "States and forces for the arguments of left_on_modes; NaN where no posture is found.");
  nb::class_<RedefinedMotion<Space>, Motion>(m, (space + "RedefinedMotion").c_str(),
                                             "Motors as on the path with deflections factor p + offset(t).")
      .def(nb::init<Driven, Driven, VectorXd, double, std::vector<TimeFunction>>(), "driven"_a, "path"_a, "q"_a,
           "factor"_a, "offset"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>());
}

} // namespace

void bind_prescribed(nb::module_ &m) {
  bind_driven<Planar>(m, "Planar"), bind_driven<Spatial>(m, "Spatial");
  bind_motion<Planar>(m, "Planar"), bind_motion<Spatial>(m, "Spatial");
  nb::class_<Prescribed>(m, "Prescribed", "A prescribed motion and its forces at times (T,).")
      .def_ro("q", &Prescribed::q, "(T, n_q)")
      .def_ro("v", &Prescribed::v, "(T, n_v)")
      .def_ro("a", &Prescribed::a, "(T, n_v)")
      .def_ro("required", &Prescribed::required, "(T, n_v) M a - Q.")
      .def_ro("multipliers", &Prescribed::multipliers, "(T, constraint equations) with joints that move freely.")
      .def_ro("tau", &Prescribed::tau, "(T, motors) motor torques in place of these.")
      .def_ro("left", &Prescribed::left, "(T, n_v) part of `required` that motors and loops leave.")
      .def_ro("loops", &Prescribed::loops, "(T, constraint equations of loops) their multipliers under the motors.");
}
