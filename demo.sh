#!/usr/bin/env bash
# Sets up what is missing, then runs the two-link manipulator of the paper: inverse dynamics, forward check, figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
source scripts/setup.sh

.venv/bin/ffrobot solve cases/two_link/scene.toml
.venv/bin/ffrobot plot cases/two_link/scene.results.h5

printf '\nResults: cases/two_link/scene.results.h5\nFigures: cases/two_link/scene.results.figures/ (PNG and PDF)\n'
printf 'What they show and how they compare with the paper: cases/two_link/README.md\n'
