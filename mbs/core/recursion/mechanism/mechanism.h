// The constants of a mechanism, made once from what the caller says. Whatever can be decided before an evaluation is
// decided here: which blocks of a body exist, whether its frame can sit at its joint, which child each port carries,
// which ports pass moments, where constraint equations attach.
#pragma once

#include "core/recursion/mechanism/space.h"

namespace ffrobot::recursion {

// A body with its inboard joint.
template <class Space> struct Node {
  typename Space::Body body;
  JointKind joint = JointKind::revolute;
  JointShape shape{};
  double lead = 0, rotor_inertia = 0, gear_ratio = 1;
  double rotor_turns = 1; // of a rotor per turn of the inner section: 0 in prismatic joints

  int index = 0;       // among the nodes
  int parent = -1;     // node, or -1
  int parent_port = 0; // of all ports; on the ground: of ground markers
  int first_port = 0;  // of all ports; outboard ones first
  int outboard = 0;    // how many
  int inboard =
      -1; // its port (of the body) where modes move the section that the joint holds; else its frame sits there
  int q = 0, v = 0; // first of the joint; those of the modes follow
  long modes_q = 0, modes_v = 0;
  int first_slot = 0;  // of columns: the joint's freedoms; 2 dim where it has an inboard port; dim for each outboard
                       // port, and for what a body that is alone does to the ground
  int port_slots = 0;  // the first of its ports' among them
  int first_cross = 0; // of blocks between ports: (0, 1), (0, 2) … (1, 2) …; none with a single port
  bool is_pin = false; // plane: a revolute joint, at most one port, which passes forces, and moments that are given
                       // (constrained_aba/pin_joints.h)
  // … of a pin: so is its parent, unless that is the ground; its port carries a child, and that is a pin; what
  // it hands to its port is added to what acts there
  bool parent_is_pin = false, is_loaded = false, carries_pin = false, adds_up = false;
  int moment_on_port = -1;         // … of v, along which given forces act on its port, too; -1 where none do
  int angle = -1;                  // plane: of the joint, its place in q; -1 where it does not turn
  int inner_rotation = -1;         // plane: row of W of its parent, the rotation of the section where it does
  double inner_angle = 0;          // plane: of that section undeformed, in axes of its body; of a marker of the ground
  bool is_driven = false;          // forces or constraints act along the joint's coordinates
  bool has_constraints = false;    // constraint equations that are coordinates of the joint
  bool is_single_grounded = false; // on the ground, without a child: forces on the ground are kept (Hinge::f)
  bool is_weightless = false;      // a rotor's inertia alone and no child: what carries it feels no inertia
  Vector3d origin = Vector3d::Zero();   // of the body's data, in axes of the frame
  Matrix3d axes = Matrix3d::Identity(); // of the same

  // Evaluations do not read these
  std::string name;
  std::vector<int> markers; // of the body's data: of its outboard ports, then of the section that the joint holds

  int n() const { return body.n; }
  int body_width() const { return body.row_count(); } // rows of W
  int ports() const { return static_cast<int>(body.ports.size()); }
  long p_q() const { return modes_q; }
  long p_v() const { return modes_v; }
  int joint_slot(int freedom) const { return first_slot + freedom; }
  int inboard_slot() const { return first_slot + shape.freedoms.count; }
  int port_slot(int port) const { return port_slots + port * Space::dim; }
  int ground_slot() const { return port_slot(outboard); }
};

// One side of a constraint equation, or of a wrench: a port, or a marker of the ground.
struct Attachment {
  int node = -1, port = 0; // of the node; node -1: ground marker
  int global_port = -1;    // of all ports

  bool operator==(const Attachment &) const = default;
};

// What acts on a port: side b (+1) or a (-1) of a constraint equation, or a wrench.
struct Action {
  int constraint, wrench; // -1: none
  double sign;
  bool is_point = false; // of a constraint: a force of constant direction, global axes
  double force[3] = {};  // it, with the sign
};

struct Constraint {
  ConstraintModel model;
  Attachment a, b;
  int node = -1, freedom = 0; // that has a joint coordinate
  double share = 0;           // of that: 1 where the equation is nothing else, -1 where it is taken off
  bool moves = false;         // its direction does
  bool follows = false;       // a side is a marker of the ground that turns
  double lift = 0;            // what it measures of gravity, one end being on the ground

  // What it measures, less its target: full turns do not count.
  double apart(double value, double target) const {
    const bool is_angle = model.kind == ConstraintKind::rotation || model.kind == ConstraintKind::turn;
    return is_angle ? std::remainder(value - target, 2 * M_PI) : value - target;
  }
};

template <class Space> struct Mechanism {
  using Data = typename Space::Data;
  using Marker = typename Space::Marker;

  // Throws std::invalid_argument with what was expected and found.
  Mechanism(std::vector<BodyModel<Data>> bodies, std::vector<Marker> ground, std::vector<ConstraintModel> constraints,
            std::vector<MarkerAt> wrenches, const VectorXd &gravity);

  std::vector<Node<Space>> nodes;
  std::vector<Marker> ground;
  std::vector<Constraint> constraints;
  std::vector<Attachment> wrenches; // markers on which forces act
  VectorXd gravity;                 // (linear) m/s^2
  int n_q = 0, n_v = 0, ports = 0, slots = 0, crosses = 0;
  std::vector<int> children; // of each port: its child, or -1
  std::vector<char> cleared; // of each port: what acts on it is summed up, and starts at zero
  struct Actions {
    int node, port, global_port; // of cleared ports
    std::vector<Action> list;
    bool has_points, has_others; // forces of constant direction; anything else
  };
  std::vector<Actions> actions;
  bool needs_positions = false;        // constraint equations have directions that move
  bool has_moving_constraints = false; // or follow markers of the ground that turn
  std::vector<Index> rotations;        // index in v of the first of three components of each quaternion's rate

private:
  // Phases of the constructor, in their order
  struct Plan;
  void take_tree(Plan &plan);
  void attach_constraints(const std::vector<ConstraintModel> &models, Plan &plan);
  Attachment attach(const MarkerAt &at, Plan &plan) const;
  void find_passed_moments(const std::vector<MarkerAt> &loaded, Plan &plan);
  void take_body(Node<Space> &node, Plan &plan);
  void place_frame(Node<Space> &node, Plan &plan);
  void check_coordinates() const;
  void connect_ports();
  void classify(Constraint &constraint);
  void collect_actions();
  void connect_pins();
};

} // namespace ffrobot::recursion
