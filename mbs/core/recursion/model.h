// What a mechanism is made of, as the caller says it. All arrays in axes of the body (those of its modal file), SI
// units; modes are mass-orthonormal. Symbols: docs/theory.md; Shabana, Dynamics of Multibody Systems, ch. 5.
#pragma once

#include "core/fields.h"
#include "core/recursion/joint/place.h"

#include "core/eigen.h"

#include <array>
#include <string>

namespace ffrobot::recursion {

// A section of a body: where joints, constraints and forces attach. Its rows of Phi are displacements, then rotations.
struct PlanarMarker {
  Vector2d position = Vector2d::Zero();
  double angle = 0;        // of its axes
  MatrixXd Phi;            // (3, n)
  std::vector<MatrixXd> K; // three (n, n): it moves and turns by -1/2 p^T K p besides; empty: it does not

  FFROBOT_FIELDS(position, angle, Phi, K);
};
struct SpatialMarker {
  Vector3d position = Vector3d::Zero();
  Matrix3d triad = Matrix3d::Identity(); // columns: its axes
  MatrixXd Phi;                          // (6, n)
  std::vector<MatrixXd> K;               // six (n, n): it moves and turns by -1/2 p^T K p besides; empty: it does not
  bool turns = false; // of the ground: its axes follow an orientation in time; constraint equations alone attach there

  FFROBOT_FIELDS(position, triad, Phi, K, turns);
};

// Empty matrices are zero; an empty m_xy is the identity.
struct PlanarData {
  double mass = 0, inertia = 0; // kg; kg m^2, about the origin
  Vector2d first_moment = Vector2d::Zero();
  VectorXd stiffness;     // (n) 1/s^2
  MatrixXd damping;       // (n, 1) or (n, n) 1/s
  MatrixXd S_bar;         // (2, n)
  VectorXd h, j;          // (n) I_bar_12 - I_bar_21, I_bar_11 + I_bar_22
  MatrixXd S_tilde, m_xy; // (n, n) S_bar_12 - S_bar_21, S_bar_11 + S_bar_22
  // Geometric stiffening, empty without: points move by -1/2 p^T G p besides. Integrals of G_x, G_y, x G_x + y G_y and
  // x G_y - y G_x dm, each (n, n) and symmetric.
  std::vector<MatrixXd> K;
  std::vector<PlanarMarker> markers;
  Index modes() const { return stiffness.size(); }
  bool is_stiffened() const { return !K.empty(); }

  FFROBOT_FIELDS(mass, inertia, first_moment, stiffness, damping, S_bar, h, j, S_tilde, m_xy, K, markers);
};
struct SpatialData {
  double mass = 0;
  Vector3d first_moment = Vector3d::Zero();
  Matrix3d J2 = Matrix3d::Zero();   // kg m^2, integral of x x^T dm
  VectorXd stiffness;               // (n) 1/s^2
  MatrixXd damping;                 // (n, 1) or (n, n) 1/s
  MatrixXd S_bar;                   // (3, n)
  MatrixXd I_bar;                   // (9, n), row 3 k + l: integral of x_k S_l dm
  std::array<MatrixXd, 9> S_bar_kl; // (n, n), 3 k + l
  // Geometric stiffening, empty without: points move by -1/2 p^T G p besides. Integrals of G_l dm (3) and, at 3 k + l,
  // of x_k G_l dm (9), each (n, n) and symmetric.
  std::vector<MatrixXd> K_s, K_x;
  // Rotary inertia that a line of mass has not, of spin about `spin_axis`: J_s, h_s (n), S_s (n, n), with S_s booked in
  // S_bar_kl as motion along `spin_booked` (formulation of Euler-Bernoulli links).
  double J_spin = 0;
  VectorXd h_spin;
  MatrixXd S_spin;
  Vector3d spin_axis = Vector3d::UnitX(), spin_booked = Vector3d::UnitZ();
  Matrix3d axes = Matrix3d::Identity(); // columns: those of the modal file, where most blocks vanish
  std::vector<SpatialMarker> markers;
  Index modes() const { return stiffness.size(); }
  bool is_stiffened() const { return !K_s.empty(); }

  FFROBOT_FIELDS(mass, first_moment, J2, stiffness, damping, S_bar, I_bar, S_bar_kl, K_s, K_x, J_spin, h_spin, S_spin,
                 spin_axis, spin_booked, markers);
};

// The tree: body i is joined to marker `parent_marker` of a body before it, or of the ground (parent -1).
template <class Data> struct BodyModel {
  std::string name;
  int parent = -1, parent_marker = 0, inboard_marker = 0;
  JointKind joint = JointKind::revolute;
  double lead = 0;          // m/rad, of a screw
  double rotor_inertia = 0; // kg m^2, of a rotor on the inner section about z that turns `gear_ratio` times
  double gear_ratio = 1;    // as fast as the joint; rad/m in prismatic ones, where that the section turns is left out
  bool driven = false;      // forces or constraints act along the joint's coordinates
  bool of_section = false;  // these are the section's even where modes turn it and nothing acts along them
  Data data;

  FFROBOT_FIELDS(name, parent, parent_marker, inboard_marker, joint, lead, rotor_inertia, gear_ratio, driven,
                 of_section, data);
};

struct MarkerAt {
  int body = -1, marker = 0; // body -1: of the ground
  bool only_forces = false;  // of a wrench in the plane: its moment is zero at all times

  FFROBOT_FIELDS(body, marker);
};

// Constraint equations between two markers: what is zero, or follows a target. In the plane axes have two components,
// and `rotation` is the difference of angles; in space it is f . log(A_b A_a^T), which is meant to stay zero.
enum class ConstraintKind {
  point,      // n . (r_b - r_a), n in global axes
  slide,      // n . (r_b - r_a), n in axes of section a
  dot,        // f . g, f in axes of section a, g in axes of section b (space)
  rotation,   // rotation of b against a about n, global axes; as a rate n . (Omega_b - Omega_a)
  turn,       // angle of g of b about f of a (space), f and g unit vectors across each other in axes of both
  coordinate, // joint coordinate v[coordinate]
};
struct ConstraintModel {
  std::string name;
  ConstraintKind kind = ConstraintKind::point;
  MarkerAt a, b;
  Vector3d f = Vector3d::UnitX(), g = Vector3d::UnitX(); // n is f
  int coordinate = -1; // in v; of a rotation, turn or slide it is taken off, where there is one

  FFROBOT_FIELDS(name, kind, a, b, f, g, coordinate);
};

} // namespace ffrobot::recursion
