"""What random scenes in plane and space have in common: what is drawn of a robot, its beams, and its path in time."""

STEEL, ALUMINIUM = (2.07e11, 7850.0), (7.0e10, 2700.0)
SHAPES = {"quintic": "(10*{s}**3-15*{s}**4+6*{s}**5)", "cosine": "0.5*(1-cos(pi*{s}))", "jolt": "{s}**2"}


class DrawnRobot:
    """Drawn from `rng`; a run takes between `shortest` and `longest` (s)."""

    def __init__(self, rng, shortest, longest):
        self.rng = rng
        self.end = self.between(shortest, longest)
        self.damping = float(rng.choice([0.0, rng.uniform(0.001, 0.02)], p=[0.4, 0.6]))
        self.shape = str(rng.choice(list(SHAPES), p=[0.5, 0.25, 0.25]))
        self.start = str(rng.choice(["static", "undeformed"], p=[0.6, 0.4]))

    def between(self, low, high):
        return float(self.rng.uniform(low, high))

    def beam(self, length, slimness):
        """Keys of a link: a steel or aluminium beam, a rectangle `slimness` times as wide as high or a tube."""
        E, density = STEEL if self.rng.random() < 0.5 else ALUMINIUM
        height = length * self.between(0.012, 0.03)
        if self.rng.random() < 0.5:
            section = {"shape": "rectangle", "height": height, "width": slimness * height}
        else:
            section = {"shape": "tube", "outer": height, "inner": 0.8 * height}
        return {
            "material": {"youngs_modulus": E, "poissons_ratio": 0.3, "density": density},
            "geometry": {"kind": "beam", "length": length, "section": section},
            "mesh": {"elements": 14},
            "damping": {"ratio": self.damping},
        }

    def reference(self):
        return {"condition": str(self.rng.choice(["simply-supported", "cantilever"]))}

    def path(self, start, change):
        """An expression in t that goes `change` from `start`."""
        return f"{float(start)!r}+({float(change)!r})*{SHAPES[self.shape].format(s=f'(t/{self.end!r})')}"

    def reach(self):
        """How far something may move in the time of the run: accelerations stay below some g."""
        return self.between(5.0, 40.0) * self.end**2 / 6
