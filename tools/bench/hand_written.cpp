// The two-link case written by hand for exactly this mechanism: joint coordinates, sizes known to the compiler. What
// the general core is measured against. Reads the numbers of the links, prints times and results.
//
// Link 1 is simply supported (its ends stay on the frame's x axis), link 2 a cantilever, bending only, no damping:
// S_bar_x = 0, j = 0, S_tilde = 0, m_xy = I. Coordinates y = (theta1, theta2, p1, p2) and their rates.
#include "core/integrate/dop853_tableau.h"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace {

constexpr int modes = 10, coordinates = 2 + 2 * modes, size = 2 * coordinates;
constexpr double pi = 3.14159265358979323846, g = 9.81;
using Modes = std::array<double, modes>;
using Vector = std::array<double, size>;

struct Link {
  double mass, inertia, first_moment, length;
  Modes stiffness, S_y, h, tip; // tip: transverse displacement
  // constant products of the rows above
  double S_S, S_h, S_tip, h_h, h_tip, tip_tip;
};

double dot(const Modes &a, const Modes &b) {
  double sum = 0;
  for (int i = 0; i < modes; ++i)
    sum += a[i] * b[i];
  return sum;
}

struct Target {
  double x, y, x_dot, y_dot, x_ddot, y_ddot;
};

Target target(double t) {
  const double w = pi / 4, c = std::cos(w * t), s = std::sin(w * t), a = 1.5, b = std::sqrt(3.0) / 2;
  return {a * c, b * c, -a * w * s, -b * w * s, -a * w * w * c, -b * w * w * c};
}

struct Sums { // over the modes of a link
  double S_p = 0, h_p = 0, tip_p = 0, S_v = 0, tip_v = 0, S_k = 0, h_k = 0, tip_k = 0, p_p = 0, p_v = 0;
};

Sums sums(const Link &l, const double *p, const double *v) {
  Sums s;
  for (int i = 0; i < modes; ++i) {
    const double k = l.stiffness[i] * p[i];
    s.S_p += l.S_y[i] * p[i];
    s.h_p += l.h[i] * p[i];
    s.tip_p += l.tip[i] * p[i];
    s.S_v += l.S_y[i] * v[i];
    s.tip_v += l.tip[i] * v[i];
    s.S_k += l.S_y[i] * k;
    s.h_k += l.h[i] * k;
    s.tip_k += l.tip[i] * k;
    s.p_p += p[i] * p[i];
    s.p_v += p[i] * v[i];
  }
  return s;
}

Link link1, link2;

// dy, and the force on the tip in `force`
void slope(const Target &at, const double *y, double *dy, double *force) {
  const double *rates = y + coordinates;
  const double c1 = std::cos(y[0]), s1 = std::sin(y[0]), c2 = std::cos(y[1]), s2 = std::sin(y[1]);
  const double w1 = rates[0], w2 = rates[1], w1_2 = w1 * w1, w2_2 = w2 * w2, L = link1.length;
  const double *p1 = y + 2, *p2 = p1 + modes, *v1 = rates + 2, *v2 = v1 + modes;
  const Sums a = sums(link1, p1, v1), b = sums(link2, p2, v2);

  // Link 1, p eliminated: (inertia - h.h) theta1_ddot = torque - h . Q_f + ...
  const double g1x = -g * s1, g1y = -g * c1; // gravity in its axes
  const double J1 = link1.inertia + a.p_p - link1.h_h;
  const double T1 = -2 * w1 * a.p_v + link1.first_moment * g1y - a.S_p * g1x - (w1_2 * a.h_p - a.h_k + link1.S_h * g1y);

  // Link 2 hangs on the tip of link 1: its frame accelerates with L (theta1_ddot e_theta - theta1_dot^2 e_r). In its
  // axes:
  const double cd = c1 * c2 + s1 * s2, sd = s1 * c2 - c1 * s2; // of theta1 - theta2
  const double ux = -L * sd, uy = L * cd;                      // per theta1_ddot
  const double rx = -L * w1_2 * cd, ry = -L * w1_2 * sd;       // the rest
  const double g2x = -g * s2 - rx, g2y = -g * c2 - ry;         // gravity less that
  const double m = link2.mass, M_yy = m - link2.S_S, M_y = link2.first_moment - link2.S_h, M_x = -b.S_p;
  const double J2 = link2.inertia + b.p_p - link2.h_h;
  const double S_Q = w2_2 * b.S_p - b.S_k + link2.S_S * g2y; // rows times Q_f, gravity in
  const double h_Q = w2_2 * b.h_p - b.h_k + link2.S_h * g2y;
  const double t_Q = w2_2 * b.tip_p - b.tip_k + link2.S_tip * g2y;
  const double Fx = m * g2x + w2_2 * link2.first_moment + 2 * w2 * b.S_v; // forces on the frame, in its axes
  const double Fy = m * g2y + w2_2 * b.S_p - S_Q;
  const double T2 = -2 * w2 * b.p_v + link2.first_moment * g2y - b.S_p * g2x - h_Q;

  // Symmetric 2 x 2 mass of (theta1, theta2)
  const double M11 = J1 + m * ux * ux + M_yy * uy * uy, M12 = ux * M_x + uy * M_y, M22 = J2;
  const double Q1 = T1 + ux * Fx + uy * Fy, Q2 = T2;
  const double determinant = 1 / (M11 * M22 - M12 * M12);

  // Tip in the axes of link 2: d(x, y) = u theta1_ddot + (-tip_p, L2) theta2_ddot + (0, tip . p_ddot)
  const double L2 = link2.length, x2 = -b.tip_p;
  const double B11 = ux, B12 = x2, B21 = uy - link2.S_tip * uy, B22 = L2 - link2.h_tip;
  const double free1 = (M22 * Q1 - M12 * Q2) * determinant, free2 = (M11 * Q2 - M12 * Q1) * determinant;
  const double ax = c2 * at.x_ddot + s2 * at.y_ddot, ay = -s2 * at.x_ddot + c2 * at.y_ddot;
  const double ex = B11 * free1 + B12 * free2 + rx - w2_2 * L2 - 2 * w2 * b.tip_v - ax;
  const double ey = B21 * free1 + B22 * free2 + ry - w2_2 * b.tip_p + t_Q - ay;
  const double X11 = (M22 * B11 - M12 * B12) * determinant, X12 = (M11 * B12 - M12 * B11) * determinant;
  const double X21 = (M22 * B21 - M12 * B22) * determinant, X22 = (M11 * B22 - M12 * B21) * determinant;
  const double S11 = B11 * X11 + B12 * X12, S12 = B11 * X21 + B12 * X22, S22 = B21 * X21 + B22 * X22 + link2.tip_tip;
  const double d = 1 / (S11 * S22 - S12 * S12);
  const double fx = -(S22 * ex - S12 * ey) * d, fy = -(S11 * ey - S12 * ex) * d; // force on the tip, axes of link 2
  const double alpha1 = free1 + X11 * fx + X21 * fy, alpha2 = free2 + X12 * fx + X22 * fy;
  force[0] = c2 * fx - s2 * fy;
  force[1] = s2 * fx + c2 * fy;

  for (int i = 0; i < coordinates; ++i)
    dy[i] = rates[i];
  double *acceleration = dy + coordinates, *q1 = acceleration + 2, *q2 = q1 + modes;
  acceleration[0] = alpha1;
  acceleration[1] = alpha2;
  const double y_force = g2y - uy * alpha1;
  for (int i = 0; i < modes; ++i) {
    q1[i] = (w1_2 - link1.stiffness[i]) * p1[i] + link1.S_y[i] * g1y - link1.h[i] * alpha1;
    q2[i] = (w2_2 - link2.stiffness[i]) * p2[i] + link2.S_y[i] * y_force - link2.h[i] * alpha2 + link2.tip[i] * fy;
  }
}

// Angles and their rates from the path, given the modes: Newton on two angles
void close(const Target &at, double *y) {
  const double L1 = link1.length, L2 = link2.length;
  double bend = 0, bend_rate = 0;
  for (int i = 0; i < modes; ++i) {
    bend += link2.tip[i] * y[2 + modes + i];
    bend_rate += link2.tip[i] * y[coordinates + 2 + modes + i];
  }
  for (int iteration = 0; iteration < 3; ++iteration) {
    const double c1 = std::cos(y[0]), s1 = std::sin(y[0]), c2 = std::cos(y[1]), s2 = std::sin(y[1]);
    const double ex = L1 * c1 + L2 * c2 - bend * s2 - at.x, ey = L1 * s1 + L2 * s2 + bend * c2 - at.y;
    const double a = -L1 * s1, b = -L2 * s2 - bend * c2, c = L1 * c1, d = L2 * c2 - bend * s2;
    const double inverse = 1 / (a * d - b * c);
    const double vx = at.x_dot + bend_rate * s2, vy = at.y_dot - bend_rate * c2;
    y[coordinates] = (d * vx - b * vy) * inverse;
    y[coordinates + 1] = (a * vy - c * vx) * inverse;
    if (std::abs(ex) + std::abs(ey) < 1e-13)
      return;
    y[0] -= (d * ex - b * ey) * inverse;
    y[1] -= (a * ey - c * ex) * inverse;
  }
}

template <const auto &Coefficients, int Count, std::size_t... j>
void advance(const std::array<Vector, 12> &K, const Vector &y, double h, Vector &out, std::index_sequence<j...>) {
  for (int i = 0; i < size; ++i)
    out[i] = y[i] + h * ((Coefficients[j] != 0 ? Coefficients[j] * K[j][i] : 0.0) + ...);
}

template <int Stage> void run_stage(double t, const Vector &y, double h, std::array<Vector, 12> &K, double *force) {
  static constexpr auto &row = ffrobot::Dop853Tableau::a[Stage];
  Vector stage;
  advance<row, Stage>(K, y, h, stage, std::make_index_sequence<Stage>());
  slope(target(t + ffrobot::Dop853Tableau::c[Stage] * h), stage.data(), K[Stage].data(), force);
}

// From the undeformed start to t = 1 s in equal steps of DOP853
Vector pcid(int steps, double *force) {
  Vector y{};
  std::array<Vector, 12> K;
  y[1] = pi / 3;
  close(target(0), y.data());
  const double h = 1.0 / steps;
  for (int n = 0; n < steps; ++n) {
    slope(target(n * h), y.data(), K[0].data(), force);
    [&]<int... i>(std::integer_sequence<int, i...>) {
      (run_stage<i + 1>(n * h, y, h, K, force), ...);
    }(std::make_integer_sequence<int, 11>());
    Vector end;
    advance<ffrobot::Dop853Tableau::b, 12>(K, y, h, end, std::make_index_sequence<12>());
    y = end;
    close(target((n + 1) * h), y.data());
  }
  slope(target(1), y.data(), K[0].data(), force);
  return y;
}

void read(std::ifstream &file, Link &l) {
  file >> l.mass >> l.inertia >> l.first_moment >> l.length;
  for (auto *row : {&l.stiffness, &l.S_y, &l.h, &l.tip})
    for (double &value : *row)
      file >> value;
  l.S_S = dot(l.S_y, l.S_y), l.S_h = dot(l.S_y, l.h), l.S_tip = dot(l.S_y, l.tip);
  l.h_h = dot(l.h, l.h), l.h_tip = dot(l.h, l.tip), l.tip_tip = dot(l.tip, l.tip);
}

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

} // namespace

// two_link LINKS EVALUATIONS STEPS: seconds per evaluation; seconds, force and angles of a run with so many steps (0:
// none)
int main(int, char **arguments) {
  std::ifstream file(arguments[1]);
  read(file, link1);
  read(file, link2);
  const int evaluations = std::atoi(arguments[2]), steps = std::atoi(arguments[3]);
  Vector y{}, dy{};
  double force[2] = {};
  y[1] = pi / 3;
  for (int i = 0; i < 2 * modes; ++i)
    y[2 + i] = 1e-4 / (1 + i);
  close(target(0.3), y.data());
  double began = seconds(), sum = 0;
  for (int n = 0; n < evaluations; ++n) {
    y[2] += 1e-18 * dy[2]; // keeps the compiler from taking it out of the loop
    slope(target(0.3 + 1e-12 * n), y.data(), dy.data(), force);
    sum += force[0];
  }
  std::printf("%.9e\n", (seconds() - began) / evaluations);
  std::printf("%.15e %.15e %.15e %.15e\n", force[0], force[1], dy[coordinates], sum / evaluations);
  if (steps > 0) {
    began = seconds();
    const Vector end = pcid(steps, force);
    const double time = seconds() - began;
    std::printf("%.9e\n%.15e %.15e %.15e %.15e\n", time, force[0], force[1], end[0], end[1]);
  }
}
