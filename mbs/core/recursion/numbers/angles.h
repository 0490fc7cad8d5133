// Sines and cosines of the angles of many joints.
#pragma once

#include "core/recursion/numbers/sines.h"
#include "core/recursion/numbers/small.h"

#include <cstddef>
#include <cstdint>

namespace ffrobot::recursion {

// Takes angles one after the other and leaves their sines and cosines: of doubles four at once. They are put together
// in a register, since written one by one and read together they would wait for memory.
template <class T> struct Angles {
  FFROBOT_INLINE void take(std::size_t i, std::size_t, const T &x, T *s, T *c) { sine_and_cosine(x, s[i], c[i]); }
};
template <> struct Angles<double> {
  FourDoubles four{};
  FFROBOT_INLINE void take(std::size_t i, std::size_t count, double x, double *s, double *c) {
    using Integers = std::int64_t __attribute__((vector_size(32)));
    const std::size_t lane = i % 4;
    four = Integers{0, 1, 2, 3} == Integers{} + static_cast<std::int64_t>(lane) ? x - FourDoubles{} : four;
    if (lane != 3 && i + 1 != count)
      return;
    sines_and_cosines(four, s + (i - lane), c + (i - lane));
  }
};

} // namespace ffrobot::recursion
