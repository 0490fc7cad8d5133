"""What is read off a motion: points, joints, energies, stresses."""
