// Sines and cosines of four numbers at once.
#pragma once

#include "core/recursion/numbers/four_doubles.h"

#include <cmath>
#include <cstdint>

namespace ffrobot {

constexpr double largest_reduced = 1e5; // beyond it the reduction below loses digits, and means nothing at last

// One by one, of lanes whose |x| is larger than that, or not finite
[[gnu::noinline]] inline void large_sines_and_cosines(FourDoubles x, double *s, double *c) {
  for (int i = 0; i < 4; ++i)
    if (!(std::abs(x[i]) < largest_reduced))
      s[i] = std::sin(x[i]), c[i] = std::cos(x[i]);
}

// Four each, of any x, within an ulp or two. Reduction after Cody and Waite, polynomials of Cephes.
[[gnu::always_inline]] inline void sines_and_cosines(const FourDoubles &x, double *s, double *c) {
  using V = FourDoubles;
  using I = std::int64_t __attribute__((vector_size(32)));
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
  write_at(s, sine_bits), write_at(c, cosine_bits);
  const V squared = x * x; // one comparison for all, of which NaN fails
  if (!(squared[0] + squared[1] + (squared[2] + squared[3]) < largest_reduced * largest_reduced)) [[unlikely]]
    large_sines_and_cosines(x, s, c);
}

} // namespace ffrobot
