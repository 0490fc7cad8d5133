"""Where a run can start and go: postures, branches, redundancy, reach and limits."""
