#!/usr/bin/env bash
# What a CI server runs. It leaves JUnit files for the server to show, and the sessions as artifacts.
set -euo pipefail
cd "$(dirname "$0")"

etb-hil check friction_check --limits limits.yaml

# One unit against its limits, and against what it measured when this was set up.
# Exit code: 0 pass, 10 the unit failed, 3 the bench failed, 4 inconclusive or not as the baseline, 5 out of time.
etb-hil run friction_check --limits limits.yaml --serial CI-1 --seed 1 --yes --timeout 600 \
    --baseline baseline.yaml --junit run.xml --json results.json

# Everything else as tests.
python -m pytest --junit-xml tests.xml --etb-sessions sessions
