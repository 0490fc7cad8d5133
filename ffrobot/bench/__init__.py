"""Run time against error of a scene, measured: `ffrobot bench`.

measuring    one solve within a budget of time, its histories, and how far these are from a reference
precision    a reference, and every integrator at every tolerance: the work-precision diagram
axes         error of mesh, of the number of modes, of time integration, and of all three
campaign     what runs in which order, what is written and printed
"""

OF_A_SCENE = ("work-precision", "axes")
