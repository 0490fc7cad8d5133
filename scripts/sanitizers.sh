#!/usr/bin/env bash
# Runs tests of the core on one that is built with AddressSanitizer, UBSan and Eigen's own checks, by hand: the build
# takes an hour of a core, the tests half of one. The first finding ends the run.
#
#   scripts/sanitizers.sh [ARGUMENT…]     arguments go to pytest; tests/mbs where none is given
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

readonly CHECKED=build/sanitizers # the folder of an environment with that core, and its build
readonly FLAGS="-O1 -g1 -fno-omit-frame-pointer -fsanitize=address,undefined"

# The packages of .venv, but not its ffrobot: path files of added folders are not read.
.venv/bin/python -m venv --system-site-packages --without-pip "$CHECKED/env"
for packages in "$PWD"/.venv/lib/python3*/site-packages; do
  printf "%s\n" "$packages" >"$CHECKED/env/lib/${packages#*/.venv/lib/}/ffrobot.pth"
done
FFROBOT_NATIVE=ON CXXFLAGS=$FLAGS .venv/bin/python -m pip --python "$CHECKED/env/bin/python" install -q --no-deps --no-build-isolation --force-reinstall . \
  --config-settings=cmake.build-type=Debug --config-settings=build-dir="$CHECKED/build"

# Python is built without sanitizers: their library has to come first, and libstdc++ with it, whose exceptions it watches.
# PYTHONSAFEPATH: not the folders of the repository in place of the package, in processes that tests start neither.
preloaded="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libstdc++.so)"
# nanobind copies matrices without entries from nowhere: no bytes, but "never null" to the sanitizer.
echo 'nonnull-attribute:nanobind/eigen/dense.h' >"$CHECKED/suppressions"
(($#)) || set -- tests/mbs
# -s: pytest would swallow what is found.
env LD_PRELOAD="$preloaded" ASAN_OPTIONS=detect_leaks=0 PYTHONSAFEPATH=1 \
  UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1:suppressions=$PWD/$CHECKED/suppressions" \
  "$CHECKED/env/bin/python" -m pytest -q -s "$@"
