"""Run time against error of a scene, measured: `ffrobot bench`.

precision    solves within a budget of time, a reference, every integrator at every tolerance; errors of mesh, number of
             modes and time integration
campaign     what runs in which order, what is written and printed
"""

OF_A_SCENE = ("work-precision", "axes")
