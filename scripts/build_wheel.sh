#!/usr/bin/env bash
# Builds a wheel into dist/, for any processor of this kind: on x86-64 it holds two variants of the core. With Python
# 3.12 or later it serves all later ones, too. Needs a C++20 compiler; pip fetches the rest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# A build folder of its own, for the one of the working copy is tuned for this machine.
FFROBOT_NATIVE=OFF "${PYTHON:-python3}" -m pip wheel . --no-deps --wheel-dir "${1:-dist}" --config-settings=build-dir=build/wheel
