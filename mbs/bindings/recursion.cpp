// The recursion in joint coordinates (docs/developer/kernel.md), for tests and for what is built upon it.
#include "core/recursion/inverse/force_slopes.h"
#include "core/recursion/inverse/observe.h"
#include "core/recursion/motion/independent_constraints.h"
#include "core/recursion/motion/mobility.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <chrono>

#include "bindings/recursion/known_motion.h"

namespace {

template <class Space>
std::tuple<VectorXd, VectorXd> evaluate(Model<Space> &model, const VectorXd &q, const VectorXd &v,
                                        const VectorXd &target, const std::optional<VectorXd> &force,
                                        const std::optional<VectorXd> &wrench) {
  model.check_state(q, v);
  check_size("target", target.size(), model.rows());
  Forces<double> forces;
  if (force) {
    check_size("force", force->size(), model.mechanism.n_v);
    forces.generalized = force->data();
  }
  if (wrench) {
    check_size("wrench", wrench->size(), Space::dim * model.mechanism.wrenches.size());
    forces.wrench = wrench->data();
  }
  VectorXd a(model.mechanism.n_v);
  accelerations(q.data(), v.data(), forces, target.data(), model.w, a.data());
  return {a, Map<const VectorXd>(model.w.lambda.data(), model.rows())};
}

template <class Space>
std::tuple<VectorXd, VectorXd> constraint_values_of(Model<Space> &model, const VectorXd &q, const VectorXd &v) {
  model.check_state(q, v);
  VectorXd value(model.rows()), rate(model.rows());
  measure(q.data(), v.data(), model.w, value.data(), rate.data());
  return {value, rate};
}

template <class Space>
Derivatives derivatives_at(Model<Space> &model, const Scene &scene, double t, const VectorXd &q, const VectorXd &v,
                           const VectorXd &supplied) {
  model.check_state(q, v);
  check_scene(model, scene);
  check_size("supplied", supplied.size(), model.mechanism.n_v);
  turn_markers(scene, t, model.w);
  keep_independent_constraints(q.data(), v.data(), model.w);
  SceneForces<Space> acting(model.mechanism, scene, nullptr, nullptr);
  acting.at(t, q.data(), v.data(), model.w);
  VectorXd force = supplied;
  if (const double *given = acting.generalized())
    force += Map<const VectorXd>(given, force.size());
  VectorXd target(model.rows()), state(q.size() + v.size());
  state << q, v;
  const std::vector<Jet> targets = targets_at(scene, t);
  for (Index r = 0; r < target.size(); ++r)
    target[r] = targets[r].acceleration;
  Derivatives found = derivatives_under(scene, t, state, force, target, model.w, true);
  for (const JointForce &joint : scene.joint_forces)
    found.a_v.col(joint.v) -= joint.friction.slope(v[joint.v]) * found.a_f.col(joint.v);
  return found;
}

template <class Space>
double time_of(Model<Space> &model, const VectorXd &q, const VectorXd &v, const VectorXd &target, int repetitions) {
  model.check_state(q, v);
  VectorXd a(model.mechanism.n_v);
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < repetitions; ++i)
    accelerations(q.data(), v.data(), Forces<double>(), target.data(), model.w, a.data());
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / repetitions;
}

template <class Space> void check_states(const Model<Space> &model, const RowMajor &q, const RowMajor &v) {
  check_size("states", v.rows(), q.rows());
  check_size("q", q.cols(), model.mechanism.n_q), check_size("v", v.cols(), model.mechanism.n_v);
}

template <class Space>
void check_postures(const Model<Space> &model, const Scene &scene, const std::vector<double> &times,
                    const RowMajor &q) {
  check_scene(model, scene);
  check_size("times", times.size(), q.rows()), check_size("q", q.cols(), model.mechanism.n_q);
}

template <class Space>
std::vector<Mobility> mobilities_of(Model<Space> &model, const Scene &scene, const std::vector<double> &times,
                                    const RowMajor &q, const std::vector<bool> &is_path, double length,
                                    Index loop_rank) {
  check_postures(model, scene, times, q);
  check_size("is_path", is_path.size(), model.rows());
  const PostureWatch watch{{is_path.begin(), is_path.end()}, length};
  std::vector<Mobility> mobilities;
  for (std::size_t i = 0; i < times.size(); ++i) {
    turn_markers(scene, times[i], model.w);
    mobilities.push_back(mobility(watch, q.row(i).data(), model.w, loop_rank));
  }
  return mobilities;
}

template <class Space> void bind_body(nb::module_ &m, const char *name) {
  bind_fields(nb::class_<BodyModel<typename Space::Data>>(
      m, name, "A body of a tree and its inboard joint; see mbs/core/recursion/model.h."));
}

template <class Space> void bind_model(nb::class_<Model<Space>> model) {
  using Body = BodyModel<typename Space::Data>;
  model
      .def(nb::init<const std::vector<Body> &, const std::vector<typename Space::Marker> &,
                    const std::vector<ConstraintModel> &, const std::vector<MarkerAt> &, const VectorXd &>(),
           "bodies"_a, "ground"_a, "rows"_a, "wrenches"_a, "gravity"_a)
      .def_prop_ro("n_q", [](const Model<Space> &model) { return model.mechanism.n_q; })
      .def_prop_ro("n_v", [](const Model<Space> &model) { return model.mechanism.n_v; })
      .def_prop_ro(
          "first",
          [](const Model<Space> &model) {
            std::vector<std::tuple<int, int, int, int>> first;
            for (const auto &node : model.mechanism.nodes)
              first.emplace_back(node.q, node.p_q(), node.v, node.p_v());
            return first;
          },
          "By body: index in q of its joint and of its modes, index in v of both.")
      .def("evaluate", &evaluate<Space>, "q"_a, "v"_a, "target"_a, "force"_a.none(), "wrench"_a.none(),
           "(a, lambda): accelerations (n_v) and multipliers (rows).")
      .def(
          "keep_independent_rows",
          [](Model<Space> &model, const VectorXd &q, const VectorXd &v) {
            model.check_state(q, v);
            keep_independent_constraints(q.data(), v.data(), model.w);
            return model.w.active;
          },
          "q"_a, "v"_a, "Numbers of constraint equations that are independent at a state; only these are kept.")
      .def("measure", &constraint_values_of<Space>, "q"_a, "v"_a, "Values and rates of constraint equations.")
      .def("derivatives", &derivatives_at<Space>, "scene"_a, "t"_a, "q"_a, "v"_a, "supplied"_a,
           "Exact, at a state at time t (s), under a scene and further forces `supplied` (n_v), without springs of "
           "joints\nand gears, and without constraint equations that depend on others.");
}

template <class Space> void bind_rest(nb::class_<Model<Space>> model) {
  model
      .def(
          "forces_at_rest",
          [](Model<Space> &model, const Scene &scene, double t, const VectorXd &q) {
            model.check_state(q, VectorXd::Zero(model.mechanism.n_v));
            check_scene(model, scene);
            return forces_at_rest(scene, t, q, model.w);
          },
          "scene"_a, "t"_a, "q"_a, "Forces and constraint equations at rest.")
      .def(
          "stiffness_at_rest",
          [](Model<Space> &model, const Scene &scene, double t, const VectorXd &q, const VectorXd &multipliers,
             const std::vector<int> &independent) {
            model.check_state(q, VectorXd::Zero(model.mechanism.n_v));
            check_scene(model, scene);
            check_size("multipliers", multipliers.size(), model.rows());
            for (const int r : independent)
              check_index("row", r, model.rows());
            return stiffness_at_rest(scene, t, q, multipliers, independent, model.w);
          },
          "scene"_a, "t"_a, "q"_a, "multipliers"_a, "independent"_a,
          "(n_v, n_v) exact derivative of C_q^T multipliers - Q by increments of q; multipliers of equations that are\n"
          "not among the `independent` ones are 0.");
}

template <class Space> void bind_kinematics(nb::class_<Model<Space>> model) {
  model
      .def(
          "frames",
          [](Model<Space> &model, const VectorXd &q, const VectorXd &v) {
            model.check_state(q, v);
            place_all(q.data(), v.data(), nullptr, model.w);
            return frame_motions(model.w);
          },
          "q"_a, "v"_a, "Motion of all frames, accelerations those of the last evaluation.")
      .def(
          "motions",
          [](Model<Space> &model, const RowMajor &q, const RowMajor &v) {
            check_states(model, q, v);
            return motions_of_states(q, v, model.w);
          },
          "q"_a, "v"_a,
          "(T, 18 (bodies + wrenches)) of states q (T, n_q), v (T, n_v): position (m), axes (3, 3) row by row, "
          "velocity and\nangular velocity of frames, which may sit at joints, and of sections on which wrenches may "
          "act.")
      .def(
          "moved",
          [](const Model<Space> &model, RowMajor q, const RowMajor &step) {
            check_states(model, q, step);
            const ConfigurationSpace space(model.mechanism.n_v, model.mechanism.rotations);
            for (Index i = 0; i < q.rows(); ++i)
              space.integrate(q.row(i).data(), 1, step.row(i).data(), q.row(i).data());
            return q;
          },
          "q"_a, "step"_a, "q (T, n_q) moved by steps along v (T, n_v), orientations along rotation vectors.");
}

template <class Space> void bind_postures(nb::class_<Model<Space>> model) {
  model
      .def(
          "constraints",
          [](Model<Space> &model, const Scene &scene, const std::vector<double> &times, const RowMajor &q) {
            check_postures(model, scene, times, q);
            return Postures<Space>(scene, model.w).constraints(times, q);
          },
          "scene"_a, "times"_a, "q"_a,
          "Values of constraint equations less targets (T, rows), less full turns, and C_v (T, rows n_v) at times (T) "
          "and q (T, n_q).")
      .def(
          "constraint_rates",
          [](Model<Space> &model, const Scene &scene, const std::vector<double> &times, const RowMajor &q,
             const RowMajor &v) {
            check_postures(model, scene, times, q), check_states(model, q, v);
            return Postures<Space>(scene, model.w).rates(times, q, v);
          },
          "scene"_a, "times"_a, "q"_a, "v"_a, "Rates of constraint equations less those of targets (T, rows).")
      .def(
          "postures",
          [](Model<Space> &model, const Scene &scene, const std::vector<double> &times, const RowMajor &q,
             const RowMajor &beside, const VectorXd &scales, const VectorXd &sizes, double largest_step) {
            check_postures(model, scene, times, q);
            check_size("scales", scales.size(), model.mechanism.n_v), check_size("sizes", sizes.size(), model.rows());
            if (beside.size())
              check_size("beside", beside.rows(), q.rows()), check_size("beside", beside.cols(), model.rows());
            return Postures<Space>(scene, model.w).solve(times, q, beside, {scales, sizes, largest_step});
          },
          "scene"_a, "times"_a, "q"_a, "beside"_a, "scales"_a, "sizes"_a, "largest_step"_a,
          "q (T, n_q) moved onto the constraint equations at times (T), and their residual (T) in natural sizes: see "
          "mbs/core/recursion/motion/postures.h.")
      .def("mobilities", &mobilities_of<Space>, "scene"_a, "times"_a, "q"_a, "is_path"_a, "length"_a, "loop_rank"_a,
           "Mobility with rigid links at times (T) and q (T, n_q); loop_rank -1: that of the loops there.");
}

// At states that are known
template <class Space> void bind_forces(nb::class_<Model<Space>> model) {
  model
      .def(
          "without_work",
          [](Model<Space> &model, const Rows &q, const Rows &forces) {
            check_size("forces", forces.rows(), q.rows()), check_size("q", q.cols(), model.mechanism.n_q);
            check_size("forces", forces.cols(), Space::dim * model.mechanism.nodes.size());
            return without_work(q, forces, model.w);
          },
          "q"_a, "forces"_a,
          "(T, dim bodies) the part of forces with moments on outer sections of joints that does no work along them.")
      .def("required_forces", &required_forces<Space>, "scene"_a, "times"_a, "q"_a, "v"_a, "a"_a,
           "M a - Q (T, n_v) along v at states q (T, n_q), v and a (T, n_v): what gravity, elasticity, damping and the "
           "forces of the scene leave for others.")
      .def("row_accelerations", &constraint_accelerations<Space>, "scene"_a, "times"_a, "q"_a, "v"_a, "a"_a,
           "Second derivatives of constraint equations (T, rows), less those of their targets.")
      .def("motion_forces", &motion_forces<Space>, "scene"_a, "times"_a, "q"_a, "v"_a, "a"_a, "multipliers"_a,
           "Forces between bodies and in joints at states q (T, n_q), v and a (T, n_v), under multipliers (T, rows) "
           "and the forces of the scene.")
      .def("multiplier_forces", &multiplier_forces<Space>, "scene"_a, "times"_a, "q"_a, "multipliers"_a,
           "Forces in joints and constraints by multipliers (T, rows) alone.")
      .def_prop_ro(
          "sections", [](const Model<Space> &model) { return ForcesOfStates<Space>::sections(model.mechanism); },
          "Body and marker of each section of MotionForces.")
      .def(
          "states_totals",
          [](const Model<Space> &model, const Scene &scene, const RowMajor &q, const RowMajor &v) {
            check_scene(model, scene);
            check_states(model, q, v);
            return totals_of_states(model.mechanism, scene, q, v);
          },
          "scene"_a, "q"_a, "v"_a,
          "(T, 10) of states q (T, n_q), v (T, n_v): kinetic, strain and gravitational energy (J), dissipated power "
          "(W), "
          "with what gears and friction of the scene store and dissipate; momentum, angular momentum about the origin.")
      .def("time_evaluations", &time_of<Space>, "q"_a, "v"_a, "target"_a, "repetitions"_a,
           "Seconds of one evaluation.");
}

template <class Space> void bind_all(nb::class_<Model<Space>> model) {
  bind_model<Space>(model), bind_rest<Space>(model), bind_kinematics<Space>(model);
  bind_postures<Space>(model), bind_forces<Space>(model);
}

} // namespace

void bind_recursion(nb::module_ &m) {
  bind_tree_data(m);
  bind_state_function(m);
  nb::class_<Derivatives>(m, "Derivatives",
                          "Of accelerations a and constraints, by increments of q, by v and forces f.")
      .def_ro("a_q", &Derivatives::a_q)
      .def_ro("a_v", &Derivatives::a_v)
      .def_ro("a_f", &Derivatives::a_f)
      .def_ro("value_q", &Derivatives::value_q)
      .def_ro("rate_q", &Derivatives::rate_q);
  nb::class_<ForcesAtRest>(m, "ForcesAtRest", "Forces and constraint equations at rest.")
      .def_ro("Q", &ForcesAtRest::Q, "(n_v) of gravity, elasticity and the scene.")
      .def_ro("value", &ForcesAtRest::value, "(rows) of constraint equations, less targets.")
      .def_ro("C_q", &ForcesAtRest::C_q, "(rows, n_v) gradients of these.")
      .def_ro("force", &ForcesAtRest::force, "N, the largest in a joint, or of a load.")
      .def_ro("moment", &ForcesAtRest::moment, "N m, the largest in a joint, or of a load.");
  nb::class_<Mobility>(m, "Mobility", "Of rigid links; see mbs/core/recursion/motion/mobility.h.")
      .def_ro("loop_rank", &Mobility::loop_rank)
      .def_ro("free", &Mobility::free, "(joint coordinates, freedoms) orthonormal motions that loops allow.")
      .def_prop_ro("ratio", &Mobility::ratio)
      .def_prop_ro("loop_ratio", &Mobility::loop_ratio)
      .def_prop_ro("followed", &Mobility::followed)
      .def_prop_ro("left", &Mobility::left, "(joint coordinates, m) motions with the path prescribed.")
      .def_prop_ro("hardest", &Mobility::hardest, "(joint coordinates) motion that the path follows least.");
  bind_body<Planar>(m, "PlanarBody"), bind_body<Spatial>(m, "SpatialBody");
  bind_all(nb::class_<Model<Planar>>(m, "PlanarModel", "A mechanism in the plane, in joint coordinates."));
  bind_all(nb::class_<Model<Spatial>>(m, "SpatialModel", "A mechanism in space, in joint coordinates."));
  bind_replay(m);
  bind_tree_motion(m);
  bind_tree_sampled(m);
  bind_forward_motion(m);
  bind_prescribed(m);
}
