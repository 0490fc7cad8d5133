# shellcheck shell=bash
# Sourced by setup.sh and pip_way.sh.

# newer_python: prints the newest Python from 3.12 on with its headers, on PATH or of pyenv; fails where there is none.
newer_python() {
  local python
  for python in python3.{14,13,12} "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.1{4,3,2}*/bin/python3 python3; do
    "$python" -I -c '
import pathlib, sys, sysconfig
headers = pathlib.Path(sysconfig.get_path("include"), "Python.h")
sys.exit(not (sys.version_info >= (3, 12) and headers.is_file()))' 2>/dev/null && type -P "$python" && return
  done
  return 1
}
