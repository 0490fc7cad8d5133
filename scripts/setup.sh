# shellcheck shell=bash
# Sourced by demo.sh and test.sh: installs whatever is missing and leaves the environment in .venv/ at the repo root.
#
# Where there are apt and root (or sudo, or nothing is missing) dolfinx, gmsh and Eigen are Debian's packages, elsewhere
# PyPI's. FFROBOT_SETUP=debian or pip decides otherwise.
#
# Each step runs only when what it depends on has changed since it last succeeded; its key is then written to
# .venv/*.stamp. When nothing has changed no step runs, and neither apt nor pip is called.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/pythons.sh

# What a user's shell may carry that does not belong in here: other Pythons, other install targets, threads in BLAS
# that slow these small systems down.
unset PYTHONPATH PYTHONHOME PYTHONSTARTUP VIRTUAL_ENV PIP_TARGET PIP_PREFIX PIP_CONSTRAINT
export PYTHONNOUSERSITE=1 PIP_USER=0 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1
# The core is for this machine only, unless told otherwise: as fast as it gets, and compiled once, not per processor.
export FFROBOT_NATIVE="${FFROBOT_NATIVE:-ON}"
export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}" OPENBLAS_NUM_THREADS="${OPENBLAS_NUM_THREADS:-1}"

# python3-dolfinx is known by no pip, and only Debian's own Python sees it, whichever python3 stands first on PATH.
readonly DEBIAN_PYTHON=/usr/bin/python3
readonly DEBIAN_PACKAGES=(
  python3 python3-venv python3-dev g++ cmake ninja-build libeigen3-dev
  python3-dolfinx python3-dolfinx-real python3-petsc4py python3-slepc4py libopenblas0-serial
  gmsh python3-gmsh python3-meshio python3-h5py python3-scipy python3-numpy
)
# What only tests need, in which pages are opened; test.sh asks for it.
TEST_PACKAGES=()
[[ -z ${WITH_TEST_PACKAGES:-} ]] || TEST_PACKAGES=(chromium chromium-driver)
SETUP_LOG=.venv/setup.log

# die MESSAGE: what is wrong and what to do about it.
die() {
  printf '\nset-up: %s\n' "$1" >&2
  exit 1
}

# step TITLE COMMAND…: runs it with one line on the screen and its output in the log, which a failure shows.
step() {
  local title=$1 start=$SECONDS from
  shift
  mkdir -p .venv
  touch "$SETUP_LOG"
  from=$(($(wc -l <"$SETUP_LOG") + 1))
  printf '  %-52s' "$title …"
  if "$@" </dev/null >>"$SETUP_LOG" 2>&1; then
    printf ' %3d s\n' $((SECONDS - start))
  else
    printf ' failed\n\n' >&2
    tail -n "+$from" "$SETUP_LOG" | tail -n 40 >&2
    die "the step \"$title\" failed; its output is above and in $SETUP_LOG"
  fi
}

# once NAME KEY TITLE COMMAND…: a step that is left out while KEY is the one of its last success.
once() {
  local stamp=.venv/$1.stamp key=$2
  shift 2
  [[ -f $stamp && $(<"$stamp") == "$key" ]] && return
  rm -f "$stamp"
  step "$@"
  printf '%s' "$key" >"$stamp"
}

digest() { sha256sum | cut -c 1-64; }

# installed_packages PACKAGE…: name and version of those that are installed, one a line.
installed_packages() {
  dpkg-query -W -f '${db:Status-Status} ${Package} ${Version}\n' "$@" 2>/dev/null |
    sed -n 's/^installed //p' || true
}

missing_packages() {
  local installed package
  installed=" $(installed_packages "$@" | cut -d ' ' -f 1 | tr '\n' ' ')"
  for package in "$@"; do
    [[ $installed == *" $package "* ]] || printf '%s\n' "$package"
  done
}

install_packages() {
  local as_root=()
  ((EUID == 0)) || as_root=(sudo)
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=600)
  "${apt[@]}" update && "${apt[@]}" install -y --no-install-recommends "$@"
}

# way: debian or pip.
way() {
  if [[ ${FFROBOT_SETUP:-} ]]; then
    printf '%s' "$FFROBOT_SETUP"
  elif type -P dpkg-query apt-get >/dev/null && { [[ -z $(missing_packages "${DEBIAN_PACKAGES[@]}" "${TEST_PACKAGES[@]}") ]] || ((EUID == 0)) || sudo -v; } 2>/dev/null; then
    printf debian
  else
    printf pip
  fi
}

# python_of WAY: the Python that the environment is made of.
python_of() {
  if [[ $1 == debian ]]; then
    printf '%s' "$DEBIAN_PYTHON"
  else
    newer_python || die "there is neither apt with root or sudo, nor a Python from 3.12 on with its headers; as root:
  apt-get install --no-install-recommends ${DEBIAN_PACKAGES[*]}"
  fi
}

debian_step() {
  local missing
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]})) || return 0
  step "installing ${#missing[@]} Debian packages" install_packages "${missing[@]}"
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} == 0)) || die "apt-get left these packages uninstalled: ${missing[*]}"
}

make_venv() {
  local options=()
  [[ $WAY == pip ]] || options=(--system-site-packages)
  "$PYTHON" -I -m venv "${options[@]}" .venv && .venv/bin/python -m pip --version
}

# What pyproject.toml asks for, with figures and reports. With Debian's dolfinx numpy, scipy and h5py have to be Debian's,
# too, which go with its HDF5. pip is told of them as constraints only, since it does not recognise Debian's h5py.
install_dependencies() {
  .venv/bin/python -I - "$WAY" <<'PYTHON' || return
import re
import sys
import tomllib
from importlib.metadata import distributions
from pathlib import Path

is_debian = sys.argv[1] == "debian"
from_debian = {"numpy", "scipy", "h5py"} if is_debian else set()
project = tomllib.loads(Path("pyproject.toml").read_text())
extras = project["project"]["optional-dependencies"]
wanted = project["build-system"]["requires"] + project["project"]["dependencies"] + extras["plot"] + extras["report"]
wanted += [] if is_debian else [*extras["fem"], "cmake>=3.20", "ninja"]
left_out = from_debian | {"cmeel-eigen"} if is_debian else set()
wanted = [line for line in wanted if re.match(r"[\w.-]+", line)[0] not in left_out]
Path(".venv/requirements.txt").write_text("\n".join(wanted) + "\n")
Path(".venv/test_requirements.txt").write_text("\n".join(extras["docs"] + extras["test"] + extras["view"]) + "\n")

# Debian's h5py calls itself h5py._debian_h5py_serial.
debian = {d.name.split(".")[0]: d.version for d in distributions(path=["/usr/lib/python3/dist-packages"])}
held = [f"{name}=={debian[name]}" for name in sorted(from_debian)]
Path(".venv/constraints.txt").write_text("\n".join(held) + "\n")
PYTHON
  .venv/bin/python -m pip install -r .venv/requirements.txt -c .venv/constraints.txt
}

# Checkers, the documentation's tools and VTK, a large download: test.sh asks for them, demo.sh does not.
install_test_packages() {
  .venv/bin/python -m pip install -r .venv/test_requirements.txt -c .venv/constraints.txt
}

# test_packages_step KEY: all that only tests need.
test_packages_step() {
  SETUP_LOG=.venv/test_packages.log
  [[ $WAY != debian ]] || debian_step "${TEST_PACKAGES[@]}"
  once tests "$1" "installing what the tests need" install_test_packages
}

# Python files are seen as they are edited; C++ sources and new files are taken in here.
build_package() {
  local site
  site=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
  PATH="$PWD/.venv/bin:$PATH" CMAKE_PREFIX_PATH=$site .venv/bin/python -m pip install --no-deps --no-build-isolation -e .
}

# Forms that links need, so that none of them waits for a compiler.
compile_forms() { .venv/bin/python -m ffrobot.fe_models.forms; }

# The environment as a user of .venv/bin/ffrobot will find it.
check_environment() {
  env -u PYTHONNOUSERSITE .venv/bin/python - "$WAY" <<'PYTHON'
import sys
from importlib.util import find_spec

for name in ("numpy", "scipy", "h5py") if sys.argv[1] == "debian" else ():
    origin = find_spec(name).origin
    if not origin.startswith("/usr/lib/python3/dist-packages/"):
        sys.exit(f"{origin} hides Debian's {name}, which dolfinx goes with: uninstall it")

import gmsh, h5py, meshio, numpy, scipy
import ffrobot.mesh.compat
from petsc4py import PETSc

if numpy.issubdtype(PETSc.ScalarType, numpy.complexfloating):
    sys.exit("PETSc with complex numbers is selected: choose the real one in 'update-alternatives --config petsc'")

import ffrobot.mbs._core
PYTHON
}

# What the compiled core and the installed file list depend on.
build_key() {
  {
    printf '%s\n' "${CXX:-}" "${CXXFLAGS:-}" "$FFROBOT_NATIVE" "$WAY"
    find ffrobot common mesh fe_models mbs actuation -name '*.py' -o -name '*.pyi' | LC_ALL=C sort
    find mbs CMakeLists.txt pyproject.toml '(' -name '*.h' -o -name '*.cpp' -o -name 'CMakeLists.txt' \
      -o -name pyproject.toml ')' -print0 | LC_ALL=C sort -z | xargs -0 sha256sum
  } | digest
}

# What defines the forms.
forms_key() { cat fe_models/forms.py fe_models/beam/beam.py fe_models/solid/{elasticity,functionals}.py | digest; }

setup() {
  exec 9<.
  flock 9 # one set-up at a time in this folder
  WAY=$(way)
  PYTHON=$(python_of "$WAY")
  if [[ $WAY == debian ]]; then
    debian_step "${DEBIAN_PACKAGES[@]}"
  fi

  local venv_key dependencies_key
  venv_key="$PWD $(readlink -f "$PYTHON") $(digest <scripts/setup.sh)"
  if [[ ! -f .venv/venv.stamp || $(<.venv/venv.stamp) != "$venv_key" ]] || ! .venv/bin/python -c '' 2>/dev/null; then
    rm -rf .venv
  fi
  if [[ ! -f .venv/venv.stamp ]]; then
    printf 'set-up: finite elements from %s\n' "$([[ $WAY == debian ]] && printf "Debian's packages" || printf 'PyPI, %s' "$("$PYTHON" -V)")"
  fi
  once venv "$venv_key" "making the virtual environment .venv" make_venv

  dependencies_key=$({ installed_packages "${DEBIAN_PACKAGES[@]}" && cat pyproject.toml; } | digest)
  once dependencies "$dependencies_key" "installing Python packages" install_dependencies
  if [[ ${WITH_TEST_PACKAGES:-} ]]; then # waits for the network: beside the build
    test_packages_step "$dependencies_key" >.venv/test_packages.txt &
    local test_packages=$!
  fi
  once build "$(build_key) $dependencies_key" "building ffrobot" build_package
  once check "$(<.venv/build.stamp)" "checking the environment" check_environment
  once forms "$dependencies_key $(forms_key)" "compiling finite element forms" compile_forms
  if [[ ${WITH_TEST_PACKAGES:-} ]]; then
    wait "$test_packages"
    cat .venv/test_packages.txt
  fi
  exec 9<&-
}

setup
