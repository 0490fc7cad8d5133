"""What pictures of scenes in space are drawn from: motions, shapes of bodies, axes of joints."""
