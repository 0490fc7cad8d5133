#include "core/analysis/spline_forces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ffrobot {

using Eigen::Index;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

namespace {

constexpr double at_once = 2e-9;      // of the run: between times of a jump
constexpr double shortest = 1e-14;    // of the run: parts that times can tell apart
constexpr int parts = 4;              // of intervals with too large errors
constexpr double steepest = 8;        // lengths of neighbours: splines through others swing
constexpr double falls = 0.5;         // what parts of parts leave of an error at most: rounding does not fall
constexpr double by_rounding = 1e-14; // of the largest number
constexpr Index fewest = 13;          // nodes, by which errors can be estimated
constexpr double unknown = std::numeric_limits<double>::infinity();

struct Node {
  double time;
  VectorXd values;
  bool is_after_jump;
  double whole, before; // errors of the interval that the one from here on is a part of, and that this was a part of
};

// Means over the run: what brief peaks allow would add up in the time around them.
RowVectorXd sizes_of(const std::vector<Node> &nodes, double error) {
  VectorXd sum = VectorXd::Zero(nodes.front().values.size());
  double largest = std::numeric_limits<double>::min();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double from = nodes[i > 0 ? i - 1 : i].time, to = nodes[i + 1 < nodes.size() ? i + 1 : i].time;
    sum += 0.5 * (to - from) * nodes[i].values.cwiseAbs();
    largest = std::max(largest, nodes[i].values.lpNorm<Eigen::Infinity>());
  }
  const double duration = nodes.back().time - nodes.front().time;
  return (sum / duration).cwiseMax(by_rounding / error * largest).transpose();
}

} // namespace

Spline::Spline(const std::vector<double> &nodes, Values values)
    : degree_(std::min(most, static_cast<int>(nodes.size()) - 1)), coefficients_(std::move(values)),
      interval_(static_cast<std::size_t>(degree_)) {
  const auto ends = static_cast<std::size_t>(degree_) + 1;
  knots_.assign(ends, nodes.front());
  if (nodes.size() > ends)
    knots_.insert(knots_.end(), nodes.begin() + 3, nodes.end() - 3);
  knots_.insert(knots_.end(), ends, nodes.back());
  solve(nodes);
}

void Spline::find_interval(double t) {
  const auto first = static_cast<std::size_t>(degree_), last = static_cast<std::size_t>(coefficients_.rows()) - 1;
  while (interval_ < last && t >= knots_[interval_ + 1])
    ++interval_;
  while (interval_ > first && t < knots_[interval_])
    --interval_;
}

void Spline::find_basis(double t) {
  const double *knots = knots_.data() + interval_;
  basis_[0] = 1;
  for (int j = 1; j <= degree_; ++j) {
    double saved = 0;
    for (int r = 0; r < j; ++r) {
      const double left = t - knots[1 - j + r], right = knots[r + 1] - t, part = basis_[r] / (left + right);
      basis_[r] = saved + right * part;
      saved = left * part;
    }
    basis_[j] = saved;
  }
}

// The matrix of the basis at the nodes is totally positive: elimination needs no pivots, and leaves its bands.
void Spline::solve(const std::vector<double> &nodes) {
  const Index n = coefficients_.rows();
  Values band = Values::Zero(n, 2 * most + 1); // column k of row r: that of the matrix with number r + k - most
  for (Index r = 0; r < n; ++r) {
    const double t = nodes[static_cast<std::size_t>(r)];
    find_interval(t);
    find_basis(t);
    const Index first = static_cast<Index>(interval_) - degree_ - r + most;
    for (int k = 0; k <= degree_; ++k)
      if (first + k >= 0 && first + k < band.cols()) // others are zero
        band(r, first + k) = basis_[k];
  }
  for (Index r = 0; r < n; ++r)
    for (Index s = r + 1; s < std::min(r + most + 1, n); ++s) {
      const double factor = band(s, r - s + most) / band(r, most);
      if (factor == 0)
        continue;
      band.row(s).segment(r - s + most, most + 1) -= factor * band.row(r).tail(most + 1);
      coefficients_.row(s) -= factor * coefficients_.row(r);
    }
  for (Index r = n - 1; r >= 0; --r) {
    for (Index s = r + 1; s < std::min(r + most + 1, n); ++s)
      coefficients_.row(r) -= band(r, s - r + most) * coefficients_.row(s);
    coefficients_.row(r) /= band(r, most);
  }
}

void Spline::evaluate(double t, double *to) {
  t = std::clamp(t, knots_.front(), knots_.back());
  find_interval(t);
  find_basis(t);
  const Index count = coefficients_.cols();
  const double *of = coefficients_.data() + (static_cast<Index>(interval_) - degree_) * count;
  std::fill_n(to, count, 0.0);
  for (int k = 0; k <= degree_; ++k, of += count)
    for (Index i = 0; i < count; ++i)
      to[i] += basis_[k] * of[i];
}

// Between knots h apart the fifth derivative jumps by h times the sixth, f6. On even ones the largest error is
// h^6 f6/30240; in the first and last intervals it is that of a polynomial through six nodes, h^6 f6/43.
VectorXd Spline::errors(const std::vector<double> &nodes, const RowVectorXd &sizes) const {
  const Index n = coefficients_.rows();
  VectorXd found = VectorXd::Constant(n - 1, unknown);
  if (n < fewest)
    return found;
  Values derivative = coefficients_;
  for (int k = 1; k <= most; ++k)
    for (Index j = n - 1; j >= k; --j) {
      const double way = knots_[static_cast<std::size_t>(j + most + 1 - k)] - knots_[static_cast<std::size_t>(j)];
      derivative.row(j) = (most + 1 - k) / way * (derivative.row(j) - derivative.row(j - 1));
    }
  const auto jump = [&](Index node) { // at the knot next to it
    const Index j = std::clamp<Index>(node, 3, n - 4) + 3;
    return (derivative.row(j) - derivative.row(j - 1)).cwiseAbs().cwiseQuotient(sizes).maxCoeff();
  };
  double before = jump(0);
  for (Index r = 0; r < n - 1; ++r) {
    const double after = jump(r + 1), h = nodes[static_cast<std::size_t>(r) + 1] - nodes[static_cast<std::size_t>(r)];
    found[r] = std::max(before, after) * std::pow(h, 5) / (std::min(r, n - 2 - r) < 3 ? 43 : 30240);
    before = after;
  }
  return found;
}

SplineForces::SplineForces(const std::vector<double> &times, Index read, const Sample &sample, double error,
                           Index count, Finish finish)
    : ForceSource(count), read_(read), finish_(std::move(finish)) {
  const double duration = times.back() - times.front();
  const std::size_t most = 10 * times.size() + 10'000; // where they are rounding
  std::vector<Node> nodes;
  const auto add = [&](double t, bool is_after_jump, double whole, double before) {
    nodes.push_back({t, VectorXd(read), is_after_jump, whole, before});
    sample(t, nodes.back().values.data());
  };
  const auto length = [&](std::size_t i) { return nodes[i + 1].time - nodes[i].time; };
  const auto divide = [&](std::size_t i) {
    const double t = nodes[i].time, h = length(i);
    for (int k = 1; k < parts && h > parts * shortest * duration && nodes.size() < most; ++k)
      add(t + k * h / parts, false, nodes[i].whole, nodes[i].before);
  };
  for (std::size_t i = 0; i < times.size(); ++i)
    add(times[i], i > 0 && times[i] - times[i - 1] <= at_once * duration, unknown, unknown);
  for (std::size_t known = 0; known < nodes.size();) {
    known = nodes.size();
    pieces_.clear();
    const RowVectorXd sizes = sizes_of(nodes, error);
    for (std::size_t first = 0, end = 1; first < known; first = end, ++end) { // between jumps
      while (end < known && !nodes[end].is_after_jump)
        ++end;
      const std::size_t before = nodes.size();
      for (std::size_t i = first; i + 1 < end; ++i)
        if ((i > first && length(i) > steepest * length(i - 1)) ||
            (i + 2 < end && length(i) > steepest * length(i + 1)))
          divide(i);
      if (nodes.size() > before)
        continue;
      std::vector<double> at(end - first);
      Spline::Values values(static_cast<Index>(end - first), read);
      for (std::size_t i = first; i < end; ++i)
        at[i - first] = nodes[i].time, values.row(static_cast<Index>(i - first)) = nodes[i].values.transpose();
      pieces_.emplace_back(at, std::move(values));
      const VectorXd errors = pieces_.back().errors(at, sizes);
      for (std::size_t i = first; i + 1 < end; ++i) {
        const double off = errors[static_cast<Index>(i - first)];
        if (!(off > error && (off < falls * nodes[i].before || nodes[i].before == unknown)))
          continue;
        nodes[i].before = std::exchange(nodes[i].whole, off);
        divide(i);
      }
    }
    std::sort(nodes.begin(), nodes.end(), [](const Node &a, const Node &b) { return a.time < b.time; });
  }
}

void SplineForces::find(double t) {
  while (piece_ + 1 < pieces_.size() && t > pieces_[piece_].end())
    ++piece_;
  while (piece_ > 0 && t <= pieces_[piece_ - 1].end())
    --piece_;
  pieces_[piece_].evaluate(t, read_.data());
  finish_(read_.data(), values_.data());
}

} // namespace ffrobot
