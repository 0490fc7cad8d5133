#!/usr/bin/env bash
# Installs ffrobot with PyPI's dolfinx into a fresh environment, solves a beam, a solid from a STEP file and the two-link
# case there, and compares the frequencies with those of .venv on the same meshes.
#
#   scripts/pip_way.sh [PYTHON]     3.12 or later; by default the newest one that is found
#
# Where there is no such Python, or PyPI cannot be reached, it says so and ends with 0.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/pythons.sh

skip() {
  printf 'pip way: left out: %s\n' "$1"
  exit 0
}
python=${1:-$(newer_python)} || skip "found no Python from 3.12 on with its headers"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
began=$SECONDS
unset PYTHONPATH PYTHONHOME VIRTUAL_ENV
export PIP_DISABLE_PIP_VERSION_CHECK=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 XDG_CACHE_HOME=$folder/cache

"$python" -m venv "$folder/venv"
new=$folder/venv/bin
"$new/pip" -q download --no-deps -d "$folder" 'dolfinx-solver-real==0.11.*' ||
  skip "PyPI cannot be reached, or has no dolfinx for this machine"
FFROBOT_NATIVE=ON "$new/pip" -q wheel . --no-deps -w "$folder" --config-settings=build-dir="$folder/build"
"$new/pip" -q install --find-links "$folder" "$(ls "$folder"/ffrobot-*.whl)[fem]"
printf 'pip way: %s, installed after %d s\n' "$("$new/python" -V)" $((SECONDS - began))
"$new/python" -m ffrobot.fe_models.forms

cp -r cases/two_link cases/lightened_arm "$folder"
rm -f "$folder"/*/*.h5
cd "$folder"
for link in two_link/link1 lightened_arm/forearm; do
  "$new/ffrobot" link $link.toml -o new.h5
  "$new/ffrobot" info new.h5 | grep -E '^(assembly|eigensolver)'
  "$OLDPWD/.venv/bin/ffrobot" link $link.toml -o old.h5 # on the mesh that the other has left in the cache
  "$new/python" - <<'PYTHON'
import ffrobot
import numpy as np

new, old = (ffrobot.read_modal_body(f"{name}.h5") for name in ("new", "old"))
assert new.family == old.family
# Attachment modes have the errors of the shapes of eigenmodes, frequencies those errors squared.
one, other = (body.frequency[: body.eigenmode_count] for body in (new, old))
np.testing.assert_allclose(one, other, rtol=1e-9)
np.testing.assert_allclose(new.frequency, old.frequency, rtol=1e-6)
print(f"frequencies agree to {np.abs(one / other - 1).max():.1e}")
PYTHON
  rm new.h5 old.h5
done
"$new/ffrobot" solve two_link/scene.toml
printf 'pip way: passed after %d s\n' $((SECONDS - began))
