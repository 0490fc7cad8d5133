#pragma once

#include <cstddef>
#include <cstring>

namespace ffrobot {

using FourDoubles = double __attribute__((vector_size(32))); // a register of AVX, or two of older processors

// One number or four, read and written where they stand, aligned or not
template <class T> [[gnu::always_inline]] inline T read_at(const double *x) {
  T value;
  std::memcpy(&value, x, sizeof value);
  return value;
}
template <class T> [[gnu::always_inline]] inline void write_at(double *x, const T &value) {
  std::memcpy(x, &value, sizeof value);
}

class FourSums {
public:
  void add(const FourDoubles &x) { four_ += x; }
  void add(double x) { rest_ += x; }
  double operator()() const { return rest_ + ((four_[0] + four_[1]) + (four_[2] + four_[3])); }

private:
  FourDoubles four_{};
  double rest_ = 0;
};

// visit(i, read) for i = 0, 4, … as long as four numbers follow, then for the others one by one; read(x + i) is what
// stands there.
template <class Visit> [[gnu::always_inline]] inline void for_fours(std::ptrdiff_t count, const Visit &visit) {
  std::ptrdiff_t i = 0;
  for (; i + 4 <= count; i += 4)
    visit(i, [](const double *x) __attribute__((always_inline)) { return read_at<FourDoubles>(x); });
  for (; i < count; ++i)
    visit(i, [](const double *x) { return *x; });
}

[[gnu::always_inline]] inline double sum_of_squares(const double *x, std::ptrdiff_t count) {
  FourSums sum;
  for_fours(count, [&](std::ptrdiff_t i, auto read) __attribute__((always_inline)) {
    const auto y = read(x + i);
    sum.add(y * y);
  });
  return sum();
}

} // namespace ffrobot
