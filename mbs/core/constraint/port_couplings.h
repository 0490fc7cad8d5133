// Rows (constraints, rotors) written over the ports of bodies: C_ddot = sum of coefficient * port acceleration + bias -
// target. Rows of every kind come down to these terms, and C M^-1 C^T to a sum over pairs of terms that meet on a body.
#pragma once

#include "core/constraint/envelope.h"
#include "core/constraint/measure.h"

#include <vector>

namespace ffrobot {

struct PortTerm {
  std::size_t row, body;
  Eigen::Index port;
  bool of_b;     // of the row's marker b, or a
  int component; // of the marker's coefficients (x, y, angle)
};

struct PortCoupling {
  Eigen::Index entry;        // of C M^-1 C^T in its envelope
  Eigen::Index mobility;     // index into the body's
  double factor;             // product of the coefficients of both terms
  std::size_t first, second; // terms
};

class PortCouplings {
public:
  // marker_rows of the bodies are set; envelope as for EnvelopeMatrix.
  PortCouplings(const std::vector<PlanarBodyState> &bodies, const std::vector<Measure> &measures,
                const EnvelopeMatrix<double> &schur);

  // Coefficients of rows whose directions move, from rows[i]; those of all others stay as they are.
  void update(const std::vector<MeasureMotion> &rows);
  const std::vector<std::size_t> &moving_rows() const { return moving_rows_; }

  void assemble(const std::vector<PlanarBodyState> &bodies, EnvelopeMatrix<double> &schur) const; // adds
  void add_accelerations(const std::vector<PlanarBodyState> &bodies, double *rows) const;
  void set_forces(const double *lambda, std::vector<PlanarBodyState> &bodies) const; // -C^T lambda

private:
  std::vector<PortTerm> terms_;
  std::vector<std::size_t> moving_rows_;
  std::vector<double> coefficient_;                  // of each term
  std::vector<std::vector<PortCoupling>> couplings_; // of each body
};

} // namespace ffrobot
