#!/usr/bin/env bash
# Builds a wheel of stage 2 into dist/, for any processor of this kind rather than tuned for the one of this machine.
# Needs a C++20 compiler and Eigen 3.4; pip fetches the rest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# A build folder of its own: the one of the working copy remembers that it was tuned.
"${PYTHON:-python3}" -m pip wheel . --no-deps --wheel-dir "${1:-dist}" \
  --config-settings=cmake.define.FFROBOT_NATIVE=OFF --config-settings=build-dir=build/wheel
