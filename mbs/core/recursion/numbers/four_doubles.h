#pragma once

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

} // namespace ffrobot
