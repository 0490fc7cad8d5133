"""Run time against error of a scene, measured: `ffrobot bench`.

measuring    one solve within a budget of time, its histories, and how far these are from a reference
precision    a reference, every integrator at every tolerance; error of mesh, modes and time integration
campaign     what runs in which order, what is written and printed
"""

OF_A_SCENE = ("work-precision", "axes")
