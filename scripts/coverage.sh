#!/usr/bin/env bash
# What of the product code tests reach, in Python and C++: runs them with both instrumented, and lists lines never run.
#
#   scripts/coverage.sh [ARGUMENT…]     arguments go to pytest; default: all tests but those of speed
#
# Subprocesses count. Writes build/coverage/python.txt and build/coverage/cpp.txt. The instrumented core takes some
# minutes to build, and is some ten times as slow as the real one, which stays as it is. Run ./test.sh once before.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly OUT=$PWD/build/coverage
readonly FOLDERS=(ffrobot common mesh fe_models mbs actuation)
(($#)) || set -- tests --ignore=tests/benchmarks --ignore=tests/packaging
.venv/bin/python -m pip install -q 'coverage>=7.6' 'gcovr>=8' -c .venv/constraints.txt

cmake -S . -B "$OUT/core" -GNinja -DCMAKE_BUILD_TYPE=Debug -DFFROBOT_NATIVE=ON -DCMAKE_CXX_FLAGS="--coverage -O1" \
  -DPython_EXECUTABLE="$PWD/.venv/bin/python" -Dnanobind_DIR="$(.venv/bin/python -m nanobind --cmake_dir)" >/dev/null
cmake --build "$OUT/core" --target _core >/dev/null
find "$OUT/core" -name '*.gcda' -delete
rm -rf "$OUT/data"
mkdir -p "$OUT/site" "$OUT/data"

cat >"$OUT/coveragerc" <<END
[run]
parallel = True
data_file = $OUT/data/coverage
include =
$(printf "    $PWD/%s/*\n" "${FOLDERS[@]}")
END
# Every Python process started below measures itself, and takes the instrumented core.
cat >"$OUT/site/sitecustomize.py" <<'END'
import os
import sys
from importlib.util import spec_from_file_location

import coverage


class Core:
    @staticmethod
    def find_spec(name, path=None, target=None):
        return spec_from_file_location(name, os.environ["COVERED_CORE"]) if name == "ffrobot.mbs._core" else None


sys.meta_path.insert(0, Core)
coverage.process_startup()
END

status=0
COVERED_CORE=$(find "$OUT/core" -name '_core*.so') PYTHONPATH=$OUT/site COVERAGE_PROCESS_START=$OUT/coveragerc \
  .venv/bin/python -m pytest "$@" || status=$?

coverage() { .venv/bin/python -m coverage "$@" --rcfile="$OUT/coveragerc"; }
coverage combine -q
coverage report --show-missing --skip-covered >"$OUT/python.txt"
.venv/bin/python -m gcovr --root . --object-directory "$OUT/core" --filter 'mbs/' --exclude-unreachable-branches \
  --txt "$OUT/cpp.txt" "$OUT/core"
tail -n 1 "$OUT/python.txt"
grep TOTAL "$OUT/cpp.txt"
exit "$status"
