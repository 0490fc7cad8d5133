"""Actuation: piezoelectric patches and the voltages they need. Motors are resolved in the core (mbs)."""
