// Coefficients of Dormand and Prince's Runge-Kutta pair 5(4) with dense output of order 4: J. R. Dormand and
// P. J. Prince, J. Comp. Appl. Math. 6 (1980); dense output: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary
// Differential Equations I, 2nd ed. 1993, sec. II.6.
#pragma once

namespace ffrobot {

struct Dopri5Tableau {
  static constexpr int stages = 6;       // of a step; the slope at its end is stage 6 (first same as last)
  static constexpr int dense_stages = 7; // for dense output, that one too
  static constexpr int dense_order = 4;

  static constexpr double c[7] = {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1, 1};
  static constexpr double a[7][7] = {
      {},
      {1. / 5},
      {3. / 40, 9. / 40},
      {44. / 45, -56. / 15, 32. / 9},
      {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
      {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
      {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84},
  };
  static constexpr auto &b = a[stages];
  // order 5 less order 4
  static constexpr double e[7] = {71. / 57600, 0, -71. / 16695, 71. / 1920, -17253. / 339200, 22. / 525, -1. / 40};
  // dense output: what it adds to the cubic Hermite polynomial, times x^2 (1 - x)^2
  static constexpr double d[7] = {-12715105075. / 11282082432.,  0,
                                  87487479700. / 32700410799.,   -10690763975. / 1880347072.,
                                  701980252875. / 199316789632., -1453857185. / 822651844.,
                                  69997945. / 29380423.};
};

} // namespace ffrobot
