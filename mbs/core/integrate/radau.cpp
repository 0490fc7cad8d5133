#include "core/integrate/radau.h"

#include <cmath>
#include <limits>

namespace ffrobot {

using VectorMap = Map<const VectorXd>;

namespace {

// Hairer and Wanner 1996, sec. IV.8, (8.1) to (8.3): nodes, eigenvalues of A^-1, its eigenvectors (columns: that of the
// real eigenvalue, real and imaginary part of the complex one) and their inverse.
const double root6 = std::sqrt(6.0);
const double node[3] = {(4 - root6) / 10, (4 + root6) / 10, 1};
const double mu_real = 3 + std::pow(3, 2. / 3) - std::pow(3, 1. / 3);
const std::complex<double> mu_complex(3 + 0.5 * (std::pow(3, 1. / 3) - std::pow(3, 2. / 3)),
                                      -0.5 * (std::pow(3, 5. / 6) + std::pow(3, 7. / 6)));
const Matrix3d T{{0.09443876248897524, -0.14125529502095421, 0.03002919410514742},
                 {0.25021312296533332, 0.20412935229379994, -0.38294211275726192},
                 {1, 1, 0}};
const Matrix3d T_inverse{{4.17871859155190428, 0.32768282076106237, 0.52337644549944951},
                         {-4.17871859155190428, -0.32768282076106237, 0.47662355450055044},
                         {0.50287263494578682, -2.57192694985560522, 0.59603920482822492}};
const Vector3d error_weights = Vector3d(-13 - 7 * root6, -13 + 7 * root6, -1) / 3; // (8.19), times gamma_0
// rows: a stage's part in the coefficients of x, x^2, x^3 of the polynomial through the start and the stages
const Matrix3d polynomial{{13. / 3 + 7 * root6 / 3, -23. / 3 - 22 * root6 / 3, 10. / 3 + 5 * root6},
                          {13. / 3 - 7 * root6 / 3, -23. / 3 + 22 * root6 / 3, 10. / 3 - 5 * root6},
                          {1. / 3, -8. / 3, 10. / 3}};

// A^-1 = T diag(mu_real, [alpha -beta; beta alpha]) T^-1, mu_complex = alpha + i beta
const Matrix3d A_inverse =
    T *
    Matrix3d{{mu_real, 0, 0}, {0, mu_complex.real(), -mu_complex.imag()}, {0, mu_complex.imag(), mu_complex.real()}} *
    T_inverse;

constexpr double noise_share = 1; // newton_share where only noise is left, which differs from step to step

} // namespace

Radau::Radau(OdeSystem &system)
    : ImplicitMethod(system), Z_(MatrixXd::Zero(2 * n_, 3)), W_(Z_), F_(Z_), change_(Z_), collocation_(Z_), slopes_(Z_),
      previous_slopes_(Z_), stage_(2 * n_), real_(2 * n_), complex_(2 * n_),
      linear_({VectorXd(system.n_stiff()), VectorXd(n_)}, {VectorXcd(system.n_stiff()), VectorXcd(n_)}) {}

// With b = r_v + mu r_q the equation (mu I - J) (dq, dv) = (r_q, r_v) is N dq + C_q^T nu = (M b + D r_q) / mu^2,
// C_q dq = C_q b / mu^2, N = M + D / mu + K / mu^2; dq = b / mu^2 + x leaves forces on the modes alone.
template <class Scalar> void Radau::solve(Scalar mu, Matrix<Scalar, Dynamic, 1> &x) {
  auto &[force, unknown] = std::get<Linear<Scalar>>(linear_);
  const Scalar inverse = Scalar(1) / mu, inverse_square = inverse * inverse;
  auto r_q = x.head(n_), b = x.tail(n_);
  b += mu * r_q;
  const auto &k = system_.stiffness(), &d = system_.damping();
  const auto stiff_force = [&](Index i, const Scalar &of_r, const Scalar &of_b) {
    return (d[i] * of_r - (d[i] * inverse + k[i] * inverse_square) * of_b) * inverse_square;
  };
  for (Index i = 0; i < n_; ++i)
    force[i] = stiff_force(i, r_q[i], b[i]);
  for (Index i = n_; i < force.size(); ++i) {
    const auto row = system_.coupling().col(i - n_).transpose().template cast<Scalar>();
    force[i] = stiff_force(i, (row * r_q).value(), (row * b).value());
  }
  if constexpr (std::is_same_v<Scalar, double>)
    system_.solve(force.data(), nullptr, unknown.data());
  else
    system_.solve(force.data(), unknown.data());
  b = b * inverse + mu * unknown - r_q; // dv = mu dq - r_q
  r_q = (b + r_q) * inverse;
}

void Radau::factorise(double t, const double *y, double h) {
  if (stale_)
    system_.linearise(t, y);
  else if (h == factorised_step_)
    return;
  const double real = h / mu_real;
  const Complex complex = h / mu_complex;
  system_.factorise(real, real * real);
  system_.factorise(complex, complex * complex);
  factorised_step_ = h;
  stale_ = false;
}

// Stages from the polynomial of the step before.
void Radau::predict(double h) {
  if (previous_step_ == 0) {
    Z_.setZero();
    return;
  }
  for (Index i = 0; i < 3; ++i) {
    const double x = 1 + node[i] * h / previous_step_;
    Z_.col(i) = collocation_ * Vector3d(x - 1, x * x - 1, x * x * x - 1);
  }
}

double Radau::largest_change(const double *y, double rate) const {
  double largest = 0;
  for (Index i = 0; i < 3; ++i) {
    const double size = system_.change_size(y, change_.col(i).data(), rate);
    largest = size <= largest ? largest : size; // keeps NaN
  }
  return largest;
}

// One iteration of Newton's method: W_, Z_ and their change.
void Radau::iterate(double t, const double *y, double h) {
  const VectorMap start(y, 2 * n_);
  for (Index i = 0; i < 3; ++i) {
    stage_ = start + Z_.col(i);
    system_.slope(t + node[i] * h, stage_.data(), F_.col(i).data());
  }
  const double real = mu_real / h;
  const Complex complex = mu_complex / h;
  const Eigen::RowVector3cd combination = T_inverse.row(1) + Complex(0, 1) * T_inverse.row(2);
  real_.noalias() = F_ * T_inverse.row(0).transpose() - real * W_.col(0);
  for (Index j = 0; j < 2 * n_; ++j)
    complex_[j] = F_(j, 0) * combination[0] + F_(j, 1) * combination[1] + F_(j, 2) * combination[2] -
                  complex * Complex(W_(j, 1), W_(j, 2));
  solve(real, real_);
  solve(complex, complex_);
  W_.col(0) += real_;
  W_.col(1) += complex_.real();
  W_.col(2) += complex_.imag();
  change_.noalias() = -Z_;
  Z_.noalias() = W_ * T.transpose();
  change_ += Z_;
}

bool Radau::solve_stages(double t, const double *y, double h, double tolerance) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  factorise(t, y, h);
  predict(h);
  W_.noalias() = Z_ * T_inverse.transpose();
  contraction_ =
      std::pow(std::max(contraction_, epsilon), 0.8); // what the step before found serves the first iteration
  double previous_size = 0;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    iterate(t, y, h);
    double size = largest_change(y, mu_real / h);
    const bool shrinks = iteration == 0 || size < previous_size;
    if (iteration > 0 && shrinks)
      contraction_ = size / (previous_size - size);
    previous_size = size;
    double share = newton_share;
    if (!shrinks) {
      // Where stiff forces are nothing but rounding, their size does not shrink: then the change of state has to do.
      contraction_ = 1;
      size = largest_change(y, 0);
      share = noise_share;
    }
    if (contraction_ * size <= std::max(share * tolerance, rounding)) {
      stale_ = contraction_ > slow_contraction;
      end_ = VectorMap(y, 2 * n_) + Z_.col(2);
      return true;
    }
    if (!shrinks || !std::isfinite(size))
      break;
  }
  stale_ = true;
  contraction_ = 1;
  return false;
}

// Where iterations with a geometry of earlier steps do not converge, they begin again with that of this one.
bool Radau::step(double t, const double *y, double h, double tolerance) {
  const bool is_new = stale_;
  return solve_stages(t, y, h, tolerance) || (!is_new && solve_stages(t, y, h, tolerance));
}

bool Radau::correct(double t) {
  real_ = end_;
  if (project(t))
    return true;
  end_ = real_;
  stale_ = true; // Newton's method in the steps did well with a geometry that the projection finds too old
  factorise(t, end_.data(), factorised_step_);
  return project(t);
}

// Order 5: the integral of the polynomial through the slopes at the stages, at the start and at two stages of the step
// before, against the method's own. Without the last one they agree (five nodes, exact for degree 4 both), so the
// difference is one of Newton's divided differences. (mu - h J)^-1 mu takes the stiff parts out, as for order 3.
void Radau::estimate(double h, VectorXd &error) {
  slopes_.noalias() = Z_ * (A_inverse.transpose() / h);
  if (previous_step_ == 0) {
    error = first_slope_ + Z_ * (error_weights / h);
    weight_ = 1;
  } else {
    const double ratio = previous_step_ / h;
    const double x[6] = {(node[0] - 1) * ratio, (node[1] - 1) * ratio, 0, node[0], node[1], node[2]};
    double integral = 0; // of the product over all nodes but the first, by Gauss's rule of degree 5
    for (const auto &[at, weight] : {std::pair(-std::sqrt(0.6), 5. / 18), {0., 8. / 18}, {std::sqrt(0.6), 5. / 18}}) {
      double product = weight;
      for (int j = 1; j < 6; ++j)
        product *= 0.5 + 0.5 * at - x[j];
      integral += product;
    }
    error.setZero();
    weight_ = 0;
    for (int i = 0; i < 6; ++i) {
      double weight = integral * mu_real;
      for (int j = 0; j < 6; ++j)
        if (j != i)
          weight /= x[i] - x[j];
      error += weight * (i < 3 ? previous_slopes_.col(i) : slopes_.col(i - 3));
      weight_ += weight * weight;
    }
    weight_ = std::sqrt(weight_);
  }
  solve(mu_real / h, error);
}

void Radau::slopes_to_error(double h, VectorXd &x) {
  x *= 2 * weight_;
  solve(mu_real / h, x);
}

void Radau::accept(double h) {
  collocation_.noalias() = Z_ * polynomial;
  previous_slopes_ = slopes_;
  previous_step_ = h;
}

void Radau::prepare_dense(double t, const double *y, double h) {
  collocation_.noalias() = Z_ * polynomial;
  ImplicitMethod::prepare_dense(t, y, h);
}

void Radau::interpolate(double t, double *y) const {
  const double x = (t - t0_) / h_;
  Map<VectorXd>(y, 2 * n_) = start_ + collocation_ * Vector3d(x, x * x, x * x * x);
}

} // namespace ffrobot
