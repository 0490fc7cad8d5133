#include "core/constraint/port_couplings.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

namespace {

// Terms of a row at one of its markers: one where its direction is fixed to the axes, all it may need otherwise.
void add_terms(const Measure &row, std::size_t r, bool of_b, const std::vector<PlanarBodyState> &bodies,
               std::vector<PortTerm> &terms) {
  const MarkerReference &m = of_b ? row.b : row.a;
  if (m.body < 0)
    return;
  const auto body = static_cast<std::size_t>(m.body);
  for (int component = 0; component < 3; ++component) {
    if (moves(row.kind) ? (of_b && component == 2) : component != component_of(row.kind))
      continue;
    terms.push_back({r, body, bodies[body].rows.port(3 + 3 * m.marker + component), of_b, component});
  }
}

double coefficient(const PortTerm &term, const MeasureMotion &motion) {
  return (term.of_b ? motion.coefficient_b : motion.coefficient_a)[term.component];
}

} // namespace

PortCouplings::PortCouplings(const std::vector<PlanarBodyState> &bodies, const std::vector<Measure> &measures,
                             const EnvelopeMatrix<double> &schur) {
  for (std::size_t r = 0; r < measures.size(); ++r) {
    const Measure &row = measures[r];
    const std::size_t first = terms_.size();
    add_terms(row, r, true, bodies, terms_);
    add_terms(row, r, false, bodies, terms_);
    MeasureMotion motion;
    evaluate(row, bodies, motion);
    for (std::size_t i = first; i < terms_.size(); ++i)
      coefficient_.push_back(coefficient(terms_[i], motion));
    if (moves(row.kind))
      moving_rows_.push_back(r);
  }
  couplings_.resize(bodies.size());
  for (std::size_t i = 0; i < terms_.size(); ++i)
    for (std::size_t j = 0; j < terms_.size(); ++j) {
      const PortTerm &a = terms_[i], &b = terms_[j];
      if (a.body != b.body || a.row < b.row)
        continue;
      const Index ports = bodies[a.body].rows.ports;
      const Index mobility = std::max(a.port, b.port) + std::min(a.port, b.port) * ports;
      const Index entry = schur.place(static_cast<Index>(a.row), static_cast<Index>(b.row));
      couplings_[a.body].push_back({entry, mobility, coefficient_[i] * coefficient_[j], i, j});
    }
}

void PortCouplings::update(const std::vector<MeasureMotion> &rows) {
  if (moving_rows_.empty())
    return;
  for (std::size_t i = 0; i < terms_.size(); ++i)
    coefficient_[i] = coefficient(terms_[i], rows[terms_[i].row]);
  for (auto &couplings : couplings_)
    for (PortCoupling &c : couplings)
      c.factor = coefficient_[c.first] * coefficient_[c.second];
}

void PortCouplings::assemble(const std::vector<PlanarBodyState> &bodies, EnvelopeMatrix<double> &schur) const {
  double *entries = schur.entries();
  for (std::size_t b = 0; b < couplings_.size(); ++b) {
    const double *mobility = bodies[b].mobility.data();
    for (const PortCoupling &c : couplings_[b])
      entries[c.entry] += c.factor * mobility[c.mobility];
  }
}

void PortCouplings::add_accelerations(const std::vector<PlanarBodyState> &bodies, double *rows) const {
  for (std::size_t i = 0; i < terms_.size(); ++i)
    rows[terms_[i].row] += coefficient_[i] * bodies[terms_[i].body].port_acceleration[terms_[i].port];
}

void PortCouplings::set_forces(const double *lambda, std::vector<PlanarBodyState> &bodies) const {
  for (auto &body : bodies)
    body.port_force.setZero();
  for (std::size_t i = 0; i < terms_.size(); ++i)
    bodies[terms_[i].body].port_force[terms_[i].port] -= coefficient_[i] * lambda[terms_[i].row];
}

} // namespace ffrobot
