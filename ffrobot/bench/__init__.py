"""Run time against error, measured: `ffrobot bench`.

measuring    one solve within a budget of time, and the histories it gives
errors       how far histories are from a reference, by kind of quantity
precision    a reference, and every integrator at every tolerance: the work-precision diagram
axes         error of mesh, of the number of modes, of time integration, and of all three
evaluation   time of one evaluation of the equations
evaluations  of several mechanisms in the plane and in space, beside the two-link case written by hand
growth       time per evaluation against modes and links, time of a run against outputs
hand_written the two-link case written by hand, compiled
ratio        of times that were taken in turn
aims         ratios to it
replays      forward runs that replay PCID, beside that
peer         EXUDYN on the same modal bodies
campaign     what runs in which order, what is written and printed
"""

OF_A_SCENE = ("work-precision", "axes")
PARTS = (*OF_A_SCENE, "growth", "evaluations", "aims", "replays")
PEER = "peer"  # where asked for: it needs another program
