"""Piezoelectric patches: modal forces per volt, voltages, and the mass and stiffness that they add to a link."""
