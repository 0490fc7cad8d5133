#!/usr/bin/env bash
# Sets up what is missing, then checks style and types and runs the tests. Arguments go to pytest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
source scripts/setup.sh

# mypy needs the packages where they are once installed: ffrobot.mesh, not mesh.
rm -rf build/types
mkdir -p build/types/ffrobot
ln -s "$PWD"/ffrobot/* "$PWD"/{mesh,fe_models,mbs,actuation} build/types/ffrobot/
mapfile -t cpp < <(find mbs -name '*.h' -o -name '*.cpp')

failed=()
check() {
  "$@" || failed+=("$*")
}
check .venv/bin/ruff check --quiet .
check .venv/bin/ruff format --diff --quiet .
check env -C build/types ../../.venv/bin/mypy --config-file ../../pyproject.toml --no-error-summary -p ffrobot
check .venv/bin/clang-format --dry-run --Werror "${cpp[@]}"

status=0
.venv/bin/python -m pytest "$@" || status=$?

if ((${#failed[@]})); then
  printf 'failed, see above: %s\n' "${failed[@]}" >&2
  ((status)) || status=1
fi
exit "$status"
