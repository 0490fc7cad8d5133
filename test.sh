#!/usr/bin/env bash
# Sets up what is missing, then checks style and types and runs the tests. Arguments go to pytest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
WITH_TEST_PACKAGES=yes source scripts/setup.sh

# mypy needs the packages where they are once installed: ffrobot.mesh, not mesh.
rm -rf build/types
mkdir -p build/types/ffrobot/mbs
ln -s "$PWD"/ffrobot/* "$PWD"/{common,mesh,fe_models,actuation} build/types/ffrobot/
ln -s "$PWD"/mbs/{*.py,fields,joints,scene,model,posture,linear,run,quantities,inversion,analysis,tracking} "$PWD"/.venv/lib/python3*/site-packages/ffrobot/mbs/_core.pyi build/types/ffrobot/mbs/
mapfile -t cpp < <(find mbs -name '*.h' -o -name '*.cpp')
# It takes a minute of one core: beside the first tests. NumPy's types vary with its versions: those of Debian 12 count.
checker=../../.venv/bin/mypy
[[ $(.venv/bin/python -c 'import numpy; print(numpy.__version__)') == 1.* ]] || checker="echo types are checked with NumPy 1 only, not:"
nice env -C build/types $checker --config-file ../../pyproject.toml --no-error-summary -p ffrobot >build/types.txt 2>&1 &
mypy=$!

failed=()
check() {
  local title=$1
  shift
  "$@" || failed+=("$title")
}
check "ruff check" .venv/bin/ruff check --quiet .
check "ruff format" .venv/bin/ruff format --diff --quiet .
check "clang-format" .venv/bin/clang-format --dry-run --Werror "${cpp[@]}"

# Page faults are a fifth of the tests' time in virtual machines that run within others: large pages for what malloc takes.
export GLIBC_TUNABLES=glibc.malloc.hugetlb=1

status=0
# A process for each core (nproc would return OMP_NUM_THREADS), at most four, as each and what it starts take up to
# 2 GB; a file's tests share one, and what it sets up.
# -n 0 among the arguments: one after the other.
# build/tests.xml keeps what each test took.
cores=$(env -u OMP_NUM_THREADS nproc)
.venv/bin/python -m pytest -n "$((cores < 4 ? cores : 4))" --dist loadfile --junitxml build/tests.xml "$@" || status=$?
.venv/bin/python scripts/test_costs.py build/tests.xml
check "mypy" wait "$mypy"
cat build/types.txt

if ((${#failed[@]})); then
  printf 'failed, see above: %s\n' "${failed[@]}" >&2
  ((status)) || status=1
fi
exit "$status"
