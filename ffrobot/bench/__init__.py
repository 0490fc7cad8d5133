"""Run time against error of a scene, measured: `ffrobot bench`."""

OF_A_SCENE = ("work-precision", "axes")
