"""A link file that tests fill in: an aluminum strip, 20 mm by 30 mm, clamped at its root."""

LINK = """name = "{name}"
[material]
youngs_modulus = 70e9
poissons_ratio = 0.3
density = 2700.0
[geometry]
kind = "beam"
length = {length}
section = {{ shape = "rectangle", height = 0.02, width = 0.03 }}
[mesh]
elements = {elements}
[reference]
condition = "cantilever"
[modes]
count = {count}
family = {family}
"""
