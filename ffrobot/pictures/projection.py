"""Where the viewer of a link stands: in all pictures of it in space the same."""

import numpy as np

# The link's x goes right, its y up, as in planar scenes; the viewer stands before z, towards the root and above.
AZIMUTH, ELEVATION = np.radians(28.0), np.radians(24.0)
RIGHT = np.array([np.cos(AZIMUTH), 0.0, np.sin(AZIMUTH)])
UP = np.array([np.sin(ELEVATION) * np.sin(AZIMUTH), np.cos(ELEVATION), -np.sin(ELEVATION) * np.cos(AZIMUTH)])
VIEWER = np.cross(RIGHT, UP)
