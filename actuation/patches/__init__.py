"""Piezoelectric patches: what they do per volt, the voltages, what they add to their link."""
