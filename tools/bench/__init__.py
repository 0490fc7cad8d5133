"""Benchmarks of ffrobot itself, `python -m bench`: they compile and run programs next to it.

evaluations  of several mechanisms in 2D and 3D, beside the two-link case written by hand
growth       time per evaluation against modes and links, time of a run against outputs
hand_written time of one evaluation, also of the two-link case written by hand, compiled; ratios of times
aims         ratios to it
replays      forward runs with results of PCID, beside that
peer         EXUDYN on the same modal bodies
source_tree  what runs in which order
"""
