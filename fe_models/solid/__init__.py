"""Links that are solids: elasticity, supports, modes, invariants, stresses."""
