"""Maps of a robot over its workspace: natural frequencies, stiffness, torques, sag, pose by pose."""
