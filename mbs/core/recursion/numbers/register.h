// Doubles side by side: in registers of the processor, in pairs of shorter ones where it has none so long. (Compilers
// keep vectors that are longer than a register in memory.)
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <new>
#include <vector>
#if defined(__AVX__)
#include <immintrin.h>
#endif

#define FFROBOT_INLINE [[gnu::always_inline]] inline
#define FFROBOT_NOINLINE [[gnu::noinline]] // once, not again for every number of columns

namespace ffrobot::recursion {

#if defined(__AVX512F__)
constexpr int native_lanes = 8;
#elif defined(__AVX__)
constexpr int native_lanes = 4;
#else
constexpr int native_lanes = 2;
#endif

// V: in a register; U: in memory, among other numbers. (A copy by memcpy could be of anything: after each one compilers
// read all pointers again.)
template <int n> struct Vectors {
  typedef double V __attribute__((vector_size(8 * n)));
  typedef double U __attribute__((vector_size(8 * n), aligned(8)));
  typedef std::int64_t I __attribute__((vector_size(8 * n)));
};

template <int n> struct Register;

template <int n>
  requires(n <= native_lanes)
struct Register<n> {
  using V = typename Vectors<n>::V;
  using U = typename Vectors<n>::U;
  using I = typename Vectors<n>::I;
  V v;

  FFROBOT_INLINE static Register zero() { return {V{}}; }
  FFROBOT_INLINE static V spread(double x) { return x - V{}; } // of either zero, too: no subtraction is left
  FFROBOT_INLINE static Register all(double x) { return {spread(x)}; }
  FFROBOT_INLINE static Register of(const double *x) {
    if constexpr (n == 2)
      return {V{x[0], x[1]}};
    else if constexpr (n == 4)
      return {V{x[0], x[1], x[2], x[3]}};
    else
      return {V{x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]}};
  }
  FFROBOT_INLINE static Register load(const double *x) { return {*reinterpret_cast<const U *>(x)}; }
  FFROBOT_INLINE void store(double *x) const { *reinterpret_cast<U *>(x) = v; }
  // Lane i alone: 1 in an integer mask
  FFROBOT_INLINE static I only(int i) {
    I lane;
    for (int k = 0; k < n; ++k)
      lane[k] = k;
    return lane == I{} + i;
  }
  FFROBOT_INLINE double operator[](int i) const { return v[i]; }
  FFROBOT_INLINE void set(int i, double x) { v = only(i) ? spread(x) : v; }
  FFROBOT_INLINE void add(int i, double x) { v += only(i) ? spread(x) : V{}; }
  // Zeros behind the first `count`
  FFROBOT_INLINE void keep(int count) {
    I lane;
    for (int k = 0; k < n; ++k)
      lane[k] = k;
    v = lane < I{} + count ? v : V{};
  }
  FFROBOT_INLINE double sum() const { // half and half: three additions one after the other
    if constexpr (n == 2)
      return v[0] + v[1];
    else if constexpr (n == 4)
      return (Register<n / 2>{{v[0], v[1]}} + Register<n / 2>{{v[2], v[3]}}).sum();
    else
      return (Register<n / 2>{{v[0], v[1], v[2], v[3]}} + Register<n / 2>{{v[4], v[5], v[6], v[7]}}).sum();
  }
  FFROBOT_INLINE Register &operator+=(const Register &o) { return v += o.v, *this; }
  FFROBOT_INLINE Register &operator-=(const Register &o) { return v -= o.v, *this; }
  FFROBOT_INLINE friend Register operator+(const Register &a, const Register &b) { return {a.v + b.v}; }
  FFROBOT_INLINE friend Register operator-(const Register &a, const Register &b) { return {a.v - b.v}; }
  FFROBOT_INLINE friend Register operator-(const Register &a) { return {-a.v}; }
  FFROBOT_INLINE friend Register operator*(const Register &a, const Register &b) { return {a.v * b.v}; }
  FFROBOT_INLINE friend Register operator*(double s, const Register &a) { return {a.v * s}; }
};

template <int n>
  requires(n > native_lanes)
struct Register<n> {
  using Half = Register<n / 2>;
  static constexpr int half = n / 2;
  Half low, high;

  // Copied by registers, where compilers would take structures in pairs of numbers
  Register() = default;
  FFROBOT_INLINE Register(const Half &low_, const Half &high_) : low(low_), high(high_) {}
  FFROBOT_INLINE Register(const Register &o) : low(o.low), high(o.high) {}
  FFROBOT_INLINE Register &operator=(const Register &o) { return low = o.low, high = o.high, *this; }

  FFROBOT_INLINE static Register zero() { return {Half::zero(), Half::zero()}; }
  FFROBOT_INLINE static Register all(double x) { return {Half::all(x), Half::all(x)}; }
  FFROBOT_INLINE static Register of(const double *x) { return {Half::of(x), Half::of(x + half)}; }
  FFROBOT_INLINE static Register load(const double *x) { return {Half::load(x), Half::load(x + half)}; }
  FFROBOT_INLINE void store(double *x) const { low.store(x), high.store(x + half); }
  FFROBOT_INLINE double operator[](int i) const { return i < half ? low[i] : high[i - half]; }
  FFROBOT_INLINE void set(int i, double x) { i < half ? low.set(i, x) : high.set(i - half, x); }
  FFROBOT_INLINE void add(int i, double x) { i < half ? low.add(i, x) : high.add(i - half, x); }
  FFROBOT_INLINE void keep(int count) {
    if (count < half)
      low.keep(count), high = Half::zero();
    else
      high.keep(count - half);
  }
  FFROBOT_INLINE double sum() const { return (low + high).sum(); }
  FFROBOT_INLINE Register &operator+=(const Register &o) { return low += o.low, high += o.high, *this; }
  FFROBOT_INLINE Register &operator-=(const Register &o) { return low -= o.low, high -= o.high, *this; }
  FFROBOT_INLINE friend Register operator+(const Register &a, const Register &b) {
    return {a.low + b.low, a.high + b.high};
  }
  FFROBOT_INLINE friend Register operator-(const Register &a, const Register &b) {
    return {a.low - b.low, a.high - b.high};
  }
  FFROBOT_INLINE friend Register operator-(const Register &a) { return {-a.low, -a.high}; }
  FFROBOT_INLINE friend Register operator*(const Register &a, const Register &b) {
    return {a.low * b.low, a.high * b.high};
  }
  FFROBOT_INLINE friend Register operator*(double s, const Register &a) { return {s * a.low, s * a.high}; }
};

using Eight = Register<8>;

// to_i = the sum of x_i's lanes: four by four where lanes can be added crosswise
template <int count, int n> FFROBOT_INLINE void sums(const Register<n> *x, double *to) {
#if defined(__AVX__)
  if constexpr (n >= 4) {
    const auto folded = [&](int i) {
      if constexpr (n == 4)
        return (__m256d)x[i].v;
      else if constexpr (n == 8 && native_lanes == 4)
        return (__m256d)(x[i].low + x[i].high).v;
#if defined(__AVX512F__)
      else if constexpr (n == 8)
        return _mm256_add_pd(_mm512_castpd512_pd256((__m512d)x[i].v), _mm512_extractf64x4_pd((__m512d)x[i].v, 1));
#endif
      else
        return _mm256_set_pd(0, 0, 0, x[i].sum());
    };
    const auto four = [&](int i, int left) {
      const __m256d zero = _mm256_setzero_pd();
      const __m256d ab = _mm256_hadd_pd(folded(i), left > 1 ? folded(i + 1) : zero);
      const __m256d cd = left > 2 ? _mm256_hadd_pd(folded(i + 2), left > 3 ? folded(i + 3) : zero) : zero;
      return _mm256_add_pd(_mm256_permute2f128_pd(ab, cd, 0x20), _mm256_permute2f128_pd(ab, cd, 0x31));
    };
    constexpr int rest = count % 4, first = count - rest;
#pragma GCC unroll 8
    for (int i = 0; i < first; i += 4)
      _mm256_storeu_pd(to + i, four(i, 4));
    if constexpr (rest > 0) {
      const Register<4> last{(Register<4>::V)four(first, rest)};
      for (int k = 0; k < rest; ++k)
        to[first + k] = last[k];
    }
    return;
  }
#endif
  for (int i = 0; i < count; ++i)
    to[i] = x[i].sum();
}

// The first `count` (1 to 8) of eight numbers, zeros behind them; and back. What stands behind them is not touched.
#if defined(__AVX512F__)
FFROBOT_INLINE Eight load_part(const double *x, long count) {
  return {(Eight::V)_mm512_maskz_loadu_pd(static_cast<__mmask8>((1u << count) - 1), x)};
}
FFROBOT_INLINE void store_part(double *x, const Eight &v, long count) {
  _mm512_mask_storeu_pd(x, static_cast<__mmask8>((1u << count) - 1), (__m512d)v.v);
}
#elif defined(__AVX__)
// Not by masked moves: their stores are microcode on some processors.
FFROBOT_INLINE Register<4> load_four(const double *x, long count) {
  using V = Register<4>::V;
  if (count >= 4)
    return Register<4>::load(x);
  if (count == 3)
    return {(V)_mm256_insertf128_pd(_mm256_zextpd128_pd256(_mm_loadu_pd(x)), _mm_load_sd(x + 2), 1)};
  if (count == 2)
    return {(V)_mm256_zextpd128_pd256(_mm_loadu_pd(x))};
  return count == 1 ? Register<4>{(V)_mm256_zextpd128_pd256(_mm_load_sd(x))} : Register<4>::zero();
}
FFROBOT_INLINE void store_four(double *x, const Register<4> &v, long count) {
  if (count >= 4)
    return v.store(x);
  if (count >= 2)
    _mm_storeu_pd(x, _mm256_castpd256_pd128((__m256d)v.v));
  if (count == 3)
    x[2] = v[2];
  if (count == 1)
    x[0] = v[0];
}
FFROBOT_INLINE Eight load_part(const double *x, long count) {
  return {load_four(x, count), load_four(x + 4, count - 4)};
}
FFROBOT_INLINE void store_part(double *x, const Eight &v, long count) {
  store_four(x, v.low, count), store_four(x + 4, v.high, count - 4);
}
#else
FFROBOT_INLINE Eight load_part(const double *x, long count) {
  if (count >= 8)
    return Eight::load(x);
  alignas(64) double all[8] = {};
  for (long i = 0; i < count; ++i)
    all[i] = x[i];
  return Eight::load(all);
}
FFROBOT_INLINE void store_part(double *x, const Eight &v, long count) {
  if (count >= 8)
    return v.store(x);
  alignas(64) double all[8];
  v.store(all);
  for (long i = 0; i < count; ++i)
    x[i] = all[i];
}
#endif

// What registers are loaded from: 64-byte lines of the cache, of which none is split
template <class T> struct CacheLineAllocator {
  using value_type = T;
  CacheLineAllocator() = default;
  template <class U> CacheLineAllocator(const CacheLineAllocator<U> &) {}
  T *allocate(std::size_t n) { return static_cast<T *>(::operator new(n * sizeof(T), std::align_val_t(64))); }
  void deallocate(T *p, std::size_t) { ::operator delete(p, std::align_val_t(64)); }
  friend bool operator==(const CacheLineAllocator &, const CacheLineAllocator &) { return true; }
};
template <class T> using Aligned = std::vector<T, CacheLineAllocator<T>>;

} // namespace ffrobot::recursion
