#!/usr/bin/env bash
# Installs ffrobot with PyPI's dolfinx into a fresh environment, solves a beam, a solid from a STEP file and the two-link
# case there, and compares the frequencies with those of .venv, where there is one, on the same meshes.
#
#   scripts/pip_way.sh [--stage1] [PYTHON]     3.12 or later; by default the newest one that is found
#
# --stage1: without the core, whose compilation is most of the time, and without the scene. Where there is no such
# Python, or PyPI cannot be reached, it says so and ends with 0.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/pythons.sh

skip() {
  printf 'pip way: left out: %s\n' "$1"
  exit 0
}
core=()
if [[ ${1:-} == --stage1 ]]; then
  core=(--config-settings=wheel.cmake=false --config-settings=wheel.py-api=py3)
  shift
fi
python=${1:-$(newer_python)} || skip "found no Python from 3.12 on with its headers"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
began=$SECONDS old=$PWD/.venv/bin
unset PYTHONPATH PYTHONHOME VIRTUAL_ENV
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_CACHE_DIR=${PIP_CACHE_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/pip}
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 XDG_CACHE_HOME=$folder/cache

"$python" -m venv "$folder/venv"
new=$folder/venv/bin
"$new/pip" -q download --no-deps -d "$folder" 'dolfinx-solver-real==0.11.*' ||
  skip "PyPI cannot be reached, or has no dolfinx for this machine"
FFROBOT_NATIVE=ON "$new/pip" -q wheel . --no-deps -w "$folder" --config-settings=build-dir="$folder/build" "${core[@]}"
"$new/pip" -q install --find-links "$folder" "$(ls "$folder"/ffrobot-*.whl)[fem]"
printf 'pip way: %s, installed after %d s\n' "$("$new/python" -V)" $((SECONDS - began))
if ((${#core[@]} == 0)); then # else those that two links need, as they need them
  "$new/python" -P -m ffrobot.fe_models.forms
  printf 'pip way: forms compiled after %d s\n' $((SECONDS - began))
fi

cp -r cases/two_link cases/lightened_arm "$folder"
rm -f "$folder"/*/*.h5
cd "$folder"
# Not the command ffrobot link, whose remarks need the core.
make='import sys; from ffrobot.fe_models.link import make_link; make_link(*sys.argv[1:])'
for link in two_link/link1 lightened_arm/forearm; do
  "$new/python" -c "$make" $link.toml one.h5
  PATH=$new:$PATH "$new/mpirun" -n 2 "$new/python" -c "$make" $link.toml two.h5
  [[ ! -x $old/python ]] || "$old/python" -c "$make" $link.toml old.h5 # on the mesh that is in the cache now
  "$new/python" - one.h5 two.h5 $(ls old.h5 2>/dev/null) <<'PYTHON'
import sys

import numpy as np
from ffrobot.fe_models.modal_body_file import read_modal_body

one, *others = map(read_modal_body, sys.argv[1:])
print(one.name, one.assembly, one.eigensolver, sep="; ")
for path, other in zip(sys.argv[2:], others):
    assert one.family == other.family
    # Attachment modes have the errors of the shapes of eigenmodes, frequencies those errors squared.
    f, g = (body.frequency[: body.eigenmode_count] for body in (one, other))
    np.testing.assert_allclose(f, g, rtol=1e-9)
    np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-6)
    print(f"frequencies of one.h5 and {path} agree to {np.abs(f / g - 1).max():.1e}")
PYTHON
  rm ./*.h5
done
((${#core[@]})) || "$new/ffrobot" solve two_link/scene.toml
printf 'pip way: passed after %d s\n' $((SECONDS - began))
