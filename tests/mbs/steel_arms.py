"""The arm of two steel links in the plane, with modes by stage 1."""

from beam_links import paper_link
from tables_3d import pin, planar

import ffrobot

E, RHO, HEIGHT, WIDTH = 2.068427e11, 7850.0, 0.015, 0.025
EI, LINE = E * WIDTH * HEIGHT**3 / 12, RHO * HEIGHT * WIDTH


def two_links(count, attachment, kept=None, rise=1.0, **keys):
    """The first simply supported, the second a cantilever, with a payload of 2 kg, from rest to rest in `rise` (s)."""
    of_all = {"attachment_modes": attachment, "mesh": {"elements": 40}, "damping": {"ratio": 0.005}}
    bodies = [
        {"name": name, "link": paper_link(condition, count, **of_all)} | ({"modes": kept} if kept else {})
        for name, condition in (("a", "simply-supported"), ("b", "cantilever"))
    ]
    s = f"(t/{rise})"
    way = f"(10*{s}**3-15*{s}**4+6*{s}**5)"
    tables = planar(
        bodies, [pin("O", "ground", "a.root"), pin("A", "a.tip", "b.root")],
        {"name": "swing", "kind": "pcid", "end": rise, "output_step": 0.005, "tolerance": 1e-6},
        payload=[{"point": "b.tip", "mass": 2.0}], initial={"state": "static", "angles": {"a": 0.2, "b": -0.3}},
        trajectory=[{"name": "first", "joint": "O", "value": f"0.2+0.8*{way}"},
                    {"name": "second", "joint": "A", "value": f"-0.5+0.7*{way}"}],
    )  # fmt: skip
    return ffrobot.make_scene(**tables | keys)
