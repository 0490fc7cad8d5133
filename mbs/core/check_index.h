// Numbers that callers give for what there are several of.
#pragma once

#include "core/eigen.h"

#include <stdexcept>
#include <string>
#include <string_view>

namespace ffrobot {

// Throws std::invalid_argument that says what was expected and got.
template <class Number, class Count> void check_index(std::string_view name, Number got, Count count) {
  const auto number = static_cast<Index>(got), size = static_cast<Index>(count);
  if (number < 0 || number >= size)
    throw std::invalid_argument(std::string(name) + ": expected 0 to " + std::to_string(size) + " - 1, got " +
                                std::to_string(number));
}

// The same of sizes
inline void check_size(std::string_view name, Index got, Index expected) {
  if (got != expected)
    throw std::invalid_argument(std::string(name) + ": expected size " + std::to_string(expected) + ", got " +
                                std::to_string(got));
}

} // namespace ffrobot
