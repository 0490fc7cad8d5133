// Sines and cosines of the angles of many joints.
#pragma once

#include "core/recursion/small.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ffrobot::recursion {

using FourAngles = double __attribute__((vector_size(32)));
using FourIntegers = std::int64_t __attribute__((vector_size(32)));

// |x| below 1e5, within an ulp or two. Reduction after Cody and Waite, polynomials of Cephes.
FFROBOT_INLINE void sines_and_cosines(const FourAngles &x, double *s, double *c) {
  using V = FourAngles;
  using I = FourIntegers;
  const V shift = V{} + 6755399441055744.0, shifted = x * 0.63661977236758134308 + shift, k = shifted - shift;
  const V r = (x - k * 1.5707963267341256142) - k * 6.077100506506192601e-11;
  const V z = r * r, z2 = z * z, z4 = z2 * z2;
  const V sine = r + r * z *
                         ((-1.66666666666666307295e-1 + z * 8.33333333332211858878e-3) +
                          z2 * (-1.98412698295895385996e-4 + z * 2.75573136213857245213e-6) +
                          z4 * (-2.50507477628578072866e-8 + z * 1.58962301576546568060e-10));
  const V cosine = (1 - 0.5 * z) + z2 * ((4.16666666666665929218e-2 + z * -1.38888888888730564116e-3) +
                                         z2 * (2.48015872888517045348e-5 + z * -2.75573141792967388112e-7) +
                                         z4 * (2.08757008419747316778e-9 + z * -1.13585365213876817300e-11));
  const I quadrant = __builtin_bit_cast(I, shifted), odd = -(quadrant & 1);
  const I p = __builtin_bit_cast(I, sine), q = __builtin_bit_cast(I, cosine);
  const I sine_bits = ((odd & q) | (~odd & p)) ^ ((quadrant & 2) << 62);
  const I cosine_bits = ((odd & p) | (~odd & q)) ^ (((quadrant + 1) & 2) << 62);
  std::memcpy(s, &sine_bits, sizeof sine_bits), std::memcpy(c, &cosine_bits, sizeof cosine_bits);
}

// Takes angles one after the other, and leaves their sines and cosines: of doubles four at once. They are put together
// in a register, since written one by one and read together they would wait for memory.
template <class T> struct Angles {
  FFROBOT_INLINE void take(std::size_t i, std::size_t, const T &x, T *s, T *c) { sine_and_cosine(x, s[i], c[i]); }
};
template <> struct Angles<double> {
  FourAngles four{};
  FFROBOT_INLINE void take(std::size_t i, std::size_t count, double x, double *s, double *c) {
    const std::size_t lane = i % 4;
    four = FourIntegers{0, 1, 2, 3} == FourIntegers{} + static_cast<std::int64_t>(lane) ? x - FourAngles{} : four;
    if (lane == 3 || i + 1 == count)
      sines_and_cosines(four, s + (i - lane), c + (i - lane));
  }
};

} // namespace ffrobot::recursion
