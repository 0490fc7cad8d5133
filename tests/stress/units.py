"""The same robots in other units: a body, and the two-link arm, with what makes their numbers."""

from dataclasses import dataclass, replace
from types import MappingProxyType

from bodies_by_invariants import PlanarPoint
from links import ANGLES, TIP, arm_links, quintic
from mechanisms import make_model, revolute


@dataclass(frozen=True)
class Units:
    """What one SI unit is in these: 1 m = `length` of them, and so on."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def force(self):
        return self.mass * self.length / self.time**2

    @property
    def moment(self):
        return self.force * self.length

    @property
    def gravity(self):
        return 0.0, -9.81 * self.length / self.time**2

    def body(self, body):
        """The `PlanarBody` (without geometric stiffening) in these units; modal coordinates are m √kg."""
        modal = self.length * self.mass**0.5
        points = {
            name: PlanarPoint(p.position * self.length, p.translation / self.mass**0.5, p.rotation / modal)
            for name, p in body.points.items()
        }
        return replace(
            body,
            mass=body.mass * self.mass,
            inertia=body.inertia * modal**2,
            first_moment=body.first_moment * self.mass * self.length,
            stiffness=body.stiffness / self.time**2,
            damping=body.damping / self.time,
            S_bar=body.S_bar * self.mass**0.5,
            h=body.h * modal,
            j=body.j * modal,
            points=MappingProxyType(points),
            length=body.length and body.length * self.length,
        )

    def arm(self, links=None, **keys):
        """`links.arm` in these units: the same path in the same second, wherever that is."""
        x, y = TIP[0] * self.length, TIP[1] * self.length
        path = {
            "name": "tip",
            "point": "link2.tip",
            "x": quintic(x, 0.4 * self.length, self.time),
            "y": quintic(y, 1.5 * self.length, self.time),
        }
        tables = {
            "gravity": self.gravity,
            "joint": [revolute("O", "ground", "link1.root"), revolute("A", "link1.tip", "link2.root")],
            "trajectory": [path],
            "initial": {"angles": ANGLES},
        }
        return make_model([self.body(link) for link in links or arm_links()], **(tables | keys))


SI = Units()
SYSTEMS = {
    "SI": SI,
    "mm, t, s": Units(1e3, 1e-3),
    "µm, mg, ms": Units(1e6, 1e6, 1e3),
    "km, kt, h": Units(1e-3, 1e-6, 1 / 3600),
    "cm, g, µs": Units(1e2, 1e3, 1e6),
}
