// A few numbers that go through the same operations: rows of small matrices, and what column after column of
// constraints does to a quantity.
#pragma once

#include "core/recursion/numbers/register.h"

namespace ffrobot::recursion {

// Of any scalar: element by element
template <class T, int n> struct Pack {
  T x[n];

  FFROBOT_INLINE static Pack zero() {
    Pack r;
    for (int i = 0; i < n; ++i)
      r.x[i] = T(0.);
    return r;
  }
  FFROBOT_INLINE static Pack read(const T *from) {
    Pack r;
    for (int i = 0; i < n; ++i)
      r.x[i] = from[i];
    return r;
  }
  FFROBOT_INLINE void write(T *to) const {
    for (int i = 0; i < n; ++i)
      to[i] = x[i];
  }
  FFROBOT_INLINE T operator[](int i) const { return x[i]; }
  FFROBOT_INLINE void set(int i, const T &value) { x[i] = value; }
  FFROBOT_INLINE void add(int i, const T &value) { x[i] += value; }
  FFROBOT_INLINE Pack &operator+=(const Pack &o) {
    for (int i = 0; i < n; ++i)
      x[i] += o.x[i];
    return *this;
  }
  FFROBOT_INLINE Pack &operator-=(const Pack &o) {
    for (int i = 0; i < n; ++i)
      x[i] -= o.x[i];
    return *this;
  }
  FFROBOT_INLINE friend Pack operator+(Pack a, const Pack &b) { return a += b; }
  FFROBOT_INLINE friend Pack operator-(Pack a, const Pack &b) { return a -= b; }
  FFROBOT_INLINE friend Pack operator*(const T &s, Pack a) {
    for (int i = 0; i < n; ++i)
      a.x[i] *= s;
    return a;
  }
  FFROBOT_INLINE friend Pack operator*(double s, Pack a)
    requires(!std::is_same_v<T, double>)
  {
    for (int i = 0; i < n; ++i)
      a.x[i] = s * a.x[i];
    return a;
  }
  FFROBOT_INLINE friend Pack operator*(Pack a, const Pack &b) {
    for (int i = 0; i < n; ++i)
      a.x[i] *= b.x[i];
    return a;
  }
  FFROBOT_INLINE T sum() const {
    T s = x[0];
    for (int i = 1; i < n; ++i)
      s += x[i];
    return s;
  }
};

// In a register of 2, 4, 8 … lanes; `read` and `write` need room for all of them.
template <int n>
  requires(n > 1)
struct Pack<double, n> {
  static constexpr int lanes = std::bit_ceil(static_cast<unsigned>(n));
  Register<lanes> v;

  FFROBOT_INLINE static Pack zero() { return {Register<lanes>::zero()}; }
  FFROBOT_INLINE static Pack read(const double *from) { return {Register<lanes>::load(from)}; }
  FFROBOT_INLINE void write(double *to) const { v.store(to); }
  FFROBOT_INLINE double operator[](int i) const { return v[i]; }
  FFROBOT_INLINE void set(int i, double value) { v.set(i, value); }
  FFROBOT_INLINE void add(int i, double value) { v.add(i, value); }
  FFROBOT_INLINE Pack &operator+=(const Pack &o) { return v += o.v, *this; }
  FFROBOT_INLINE Pack &operator-=(const Pack &o) { return v -= o.v, *this; }
  FFROBOT_INLINE friend Pack operator+(const Pack &a, const Pack &b) { return {a.v + b.v}; }
  FFROBOT_INLINE friend Pack operator-(const Pack &a, const Pack &b) { return {a.v - b.v}; }
  FFROBOT_INLINE friend Pack operator*(double s, const Pack &a) { return {s * a.v}; }
  FFROBOT_INLINE friend Pack operator*(const Pack &a, const Pack &b) { return {a.v * b.v}; }
  FFROBOT_INLINE double sum() const { return v.sum(); }
};

// Six of eight numbers: zeros behind them
template <class T> FFROBOT_INLINE Pack<T, 6> read_six(const T *from) {
  auto x = Pack<T, 6>::read(from);
  if constexpr (std::is_same_v<T, double>)
    x.v.keep(6);
  return x;
}

// Six numbers that are not side by side in memory
template <class T>
FFROBOT_INLINE Pack<T, 6> six(const T &a, const T &b, const T &c, const T &d, const T &e, const T &f) {
  if constexpr (std::is_same_v<T, double>) {
    const double x[8] = {a, b, c, d, e, f, 0., 0.};
    return {Eight::of(x)};
  } else
    return {{a, b, c, d, e, f}};
}

// to_i = sum of x_i
template <int count, class T, int n> FFROBOT_INLINE void sums(const Pack<T, n> (&x)[count], T *to) {
  if constexpr (std::is_same_v<T, double> && n > 1) {
    Register<Pack<T, n>::lanes> registers[count];
    for (int i = 0; i < count; ++i)
      registers[i] = x[i].v;
    sums<count>(registers, to);
  } else
    for (int i = 0; i < count; ++i)
      to[i] = x[i].sum();
}

template <class T> constexpr int full_width = std::is_same_v<T, double> ? native_lanes : 1;

// f of the numbers 0 … n - 1 of arrays: f<w>(i) of those from i on that a Pack<T, w> holds, in registers of the
// processor as long as they are full, then of what is left in shorter ones; of other scalars than doubles one by one
template <class T = double, int width = full_width<T>, class F> FFROBOT_INLINE void in_registers(long n, const F &f) {
  if constexpr (width == full_width<T>)
    for (long i = 0; i + width <= n; i += width)
      f.template operator()<width>(i);
  else if (n & width)
    f.template operator()<width>(n & -2 * width);
  if constexpr (width > 1)
    in_registers<T, width / 2>(n, f);
}

// How many numbers a Pack of n takes in memory
template <class T, int n>
constexpr int packed = std::is_same_v<T, double> ? static_cast<int>(std::bit_ceil(unsigned(n))) : n;

} // namespace ffrobot::recursion
