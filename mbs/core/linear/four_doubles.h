#pragma once

namespace ffrobot {

using FourDoubles = double __attribute__((vector_size(32))); // a register of AVX, or two of older processors

} // namespace ffrobot
