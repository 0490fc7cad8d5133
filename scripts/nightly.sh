#!/usr/bin/env bash
# What a push leaves out: all seeds of random inputs, tests of tests/nightly.txt and those marked nightly or long, faults,
# the installation by pip.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
./test.sh --nightly
.venv/bin/python -m pytest -n auto --dist loadfile tests/stress --long
.venv/bin/python tests/campaigns/faults.py
scripts/pip_way.sh
