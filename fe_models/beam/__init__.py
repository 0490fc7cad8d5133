"""Links that are beams: elements, sections, modes, stresses."""
