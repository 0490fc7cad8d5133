"""Parts of files of arms in 3D with patches: links, layouts of patches, an arm of a waist and a shoulder."""

LINK = """
name = "{name}"
[material]
youngs_modulus = 70e9
poissons_ratio = 0.33
density = 2700.0
[geometry]
kind = "beam"
length = {length}
section = {{ shape = "rectangle", height = {height}, width = {width} }}
[mesh]
elements = 4
[reference]
condition = "cantilever"
[modes]
{modes}
attachment_modes = false
[damping]
ratio = 0.01
"""
PZT = """
[[pzt]]
body = "{body}"
{keys}
count = 4
length = 0.06
width = 0.01
thickness = 0.5e-3
modulus = 63e9
d31 = 110e-12
density = 7600.0
limit = {limit}
"""
SEVEN = 'indices = [1, 2, 3, 4, 5, 6, 7]\nfamily = "all"'
ARM = """
name = "arm"
space = "spatial"
gravity = [0.0, 0.0, -9.81]
motors = "{motors}"
[[body]]
name = "column"
[body.rigid]
mass = 1.0
center = [0.0, 0.0, 0.1]
inertia = [0.01, 0.01, 0.01]
points = {{ root = [0.0, 0.0, 0.0], top = [0.0, 0.0, 0.2] }}
[[body]]
name = "link"
link = "link.toml"
[[joint]]
name = "waist"
type = "revolute"
between = ["ground", "column.root"]
axis = [0.0, 0.0, 1.0]
[[joint]]
name = "shoulder"
type = "revolute"
between = ["column.top", "link.root"]
axis = [0.0, -1.0, 0.0]
[[payload]]
point = "link.tip"
mass = 0.1
[initial]
joints = {{ waist = 0.0, shoulder = 0.0 }}
"""
