"""Bodies made of material points with random mode shapes: modes as general as a solid's (S̃, j ≠ 0, motion along z)."""

from dataclasses import dataclass, replace

import numpy as np

from ffrobot.fe_models.modal_body import Interface, ModalBody, PictureMesh, Stations
from ffrobot.mbs.model.body import from_modal_body

NAMED = ("root", "tip", "side")


@dataclass
class PointCloud:
    """Masses (k,), positions (k, 3) and mass-orthonormal mode shapes (k, 3, n); named points are material points."""

    name: str
    mass: np.ndarray
    x: np.ndarray
    Phi: np.ndarray
    section_rotation: np.ndarray  # (named points, n)
    stiffness: np.ndarray  # (n,)
    damping: np.ndarray  # (n, n)

    def kinetic_energy(self, q, v):
        """½ Σ m |ṙ|² for q = (R, θ, p)."""
        u, u_dot = self.x + self.Phi @ q[3:], self.Phi @ v[3:]
        c, s = np.cos(q[2]), np.sin(q[2])
        moved_x, moved_y = u_dot[:, 0] - v[2] * u[:, 1], u_dot[:, 1] + v[2] * u[:, 0]
        velocity = (v[0] + c * moved_x - s * moved_y, v[1] + s * moved_x + c * moved_y, u_dot[:, 2])
        return 0.5 * sum(self.mass @ component**2 for component in velocity)

    def modal_body(self):
        m, x, Phi, n = self.mass, self.x, self.Phi, len(self.stiffness)
        named = range(len(NAMED))
        turn = np.zeros((len(NAMED), 3, n))
        turn[:, 2] = self.section_rotation
        return ModalBody(
            name=self.name,
            kind="solid",
            reference_condition="cantilever",
            length=1.0,
            mass=m.sum(),
            first_moment=m @ x,
            second_moment=np.einsum("i,ik,il->kl", m, x, x),
            frequency=np.sqrt(self.stiffness) / (2 * np.pi),
            stiffness=np.diag(self.stiffness),
            modal_mass=np.einsum("i,ikm,ikn->mn", m, Phi, Phi),
            damping_ratio=np.zeros(n),
            family=("random",) * n,
            S_bar=np.einsum("i,ikn->kn", m, Phi),
            I_bar=np.einsum("i,ik,iln->kln", m, x, Phi),
            S_bar_kl=np.einsum("i,ikm,iln->klmn", m, Phi, Phi),
            interfaces={NAMED[k]: Interface(x[k], Phi[k], turn[k]) for k in named},
            stations=Stations(np.array([[0.0, 0, 0], [1, 0, 0]]), np.zeros((2, 3, n)), np.zeros((2, 3, n)), np.ones(2)),
            mesh=PictureMesh(x, np.zeros((0, 2), dtype=int), Phi),
        )

    def body(self):
        """By way of the modal body, with the dense damping put in."""
        return replace(from_modal_body(self.name, self.modal_body()), damping=self.damping)


def random_cloud(rng, name, n=4, points=12):
    """A cloud about one meter long with frequencies of a few rad/s; modal coordinates of order one are small."""
    mass = rng.uniform(0.1, 0.4, points)
    x = rng.uniform([0, -0.1, -0.1], [1, 0.1, 0.1], (points, 3))
    x[0], x[1] = [0, 0, 0], [1, 0, 0]
    shapes = rng.standard_normal((points, 3, n)).reshape(3 * points, n)
    gram = shapes.T @ (np.repeat(mass, 3)[:, None] * shapes)
    shapes = shapes @ np.linalg.inv(np.linalg.cholesky(gram)).T
    root = 0.3 * rng.standard_normal((n, n))
    sections, stiffness = rng.standard_normal((len(NAMED), n)), np.sort(rng.uniform(1, 60, n))
    return PointCloud(name, mass, x, shapes.reshape(points, 3, n), sections, stiffness, root @ root.T)
