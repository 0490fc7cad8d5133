"""Bodies in the formats of other programs: there and back, identities inside the files, what is refused."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest
from beam_links import beam_link, moved, tube
from material_points import random_cloud

from ffrobot import InputError, make_link
from ffrobot.exchange.bodies.integrals import integrals_of
from ffrobot.exchange.bodies.matrices import craig_bampton_file, exudyn_file
from ffrobot.exchange.bodies.mbdyn import fem_text, read_fem
from ffrobot.exchange.bodies.sid import read_sid, sid_text
from ffrobot.fe_models.modal_body import Interface, Stations
from ffrobot.fe_models.modal_body.craig_bampton import craig_bampton
from ffrobot.fe_models.modal_body_file import read_modal_body, write_modal_body

LINK = beam_link(0.6, tube(0.02, 0.016), 8, name="arm", modes={"count": 6}, damping={"ratio": 0.01})
"""A line of mass: torsion has inertia of its own."""
MIDDLE = {"name": "middle", "position": 0.3, "mass": 0.2, "inertia": [1e-4, 2e-4, 3e-4]}
LOADED = LINK | {"interface": [MIDDLE, {"name": "wrist", "position": 0.6}]}
"""With a mass on it that turns about all axes, and two interfaces at one place."""
HELD = LINK | {"reference": {"condition": "craig-bampton"}}

EXACT = 1e-12  # what a file carries that this program wrote: the rounding of 17 digits
FORMATS = {"sid": (sid_text, read_sid), "mbdyn": (fem_text, read_fem)}
KEPT = ("mass", "first_moment", "S_bar", "stiffness", "damping_ratio", "S_bar_kl", "modal_mass", "frequency")
OF_LINES = (*KEPT, "second_moment", "I_bar", "J_spin", "h_spin", "S_spin")


def cloud():
    """Mass points with modes in all directions: every integral is dense."""
    body = random_cloud(np.random.default_rng(5), "cloud").modal_body()
    n = body.mode_count
    return dataclasses.replace(body, damping_ratio=np.full(n, 0.02), family=("torsion",) * n)


@pytest.fixture(scope="module")
def bodies():
    made = {name: make_link(link).body for name, link in (("line", LINK), ("loaded", LOADED), ("held", HELD))}
    beside = moved(made["line"], lambda x: x + np.array([-0.2, 0.05, 0.0]))
    bent = moved(made["line"], lambda x: x + np.maximum(x[..., :1] - 0.3, 0.0) * [0.0, 0.2, 0.0])  # from the middle on
    return made | {"bent": bent, "cloud": cloud(), "beside": beside}


def differences(first, second, keys):
    """Of each field, over its largest entry."""
    found = {}
    for key in keys:
        a, b = (np.asarray(getattr(body, key) if getattr(body, key) is not None else 0.0) for body in (first, second))
        found[key] = float(np.abs(a - b).max() / max(np.abs(a).max(), 1e-12))
    return found


@pytest.mark.parametrize("file_format", FORMATS)
@pytest.mark.parametrize("name", ["line", "loaded", "held", "bent", "cloud", "beside"])
def test_there_and_back(file_format, name, bodies):
    write, read = FORMATS[file_format]
    body = bodies[name]
    text, left_out = write(body)
    back, remarks = read(text, body.name)
    assert max(differences(body, back, KEPT).values()) < EXACT
    integrals = vars(integrals_of(body))
    assert max(differences(integrals_of(body), integrals_of(back), integrals).values()) < EXACT
    if name != "loaded":  # there the sum of what sections and what the mass have by turning is kept
        assert max(differences(body, back, OF_LINES).values()) < EXACT
    assert list(back.interfaces) == list(body.interfaces)
    for label, at in body.interfaces.items():
        for key, value in vars(at).items():
            np.testing.assert_array_equal(vars(back.interfaces[label])[key], value)
    ends = [body.interfaces[name].position for name in ("root", "tip")]
    np.testing.assert_array_equal(back.stations.position[[0, -1]], ends)
    has_line = name not in ("bent", "cloud")
    assert len(back.stations.position) == (len(body.stations.position) if has_line else 2)
    assert has_line != any("between root and tip are cubics" in line for line in remarks)
    assert back.reference_condition == body.reference_condition
    assert any("geometric stiffness" in line for line in left_out)
    assert any("not in the file" in line for line in remarks)
    assert not any(" off " in line for line in remarks)  # what SID says twice


def test_modes_of_any_normalisation_become_orthonormal(bodies):
    """A .fem file with modes mixed and scaled: the same body."""
    body = bodies["cloud"]
    T = np.random.default_rng(1).standard_normal((body.mode_count, body.mode_count))
    text, _ = fem_text(mixed(body, T))
    back, _ = read_fem(text, body.name)
    np.testing.assert_allclose(back.frequency, body.frequency, rtol=1e-10)
    signs = np.sign(np.einsum("an,an->n", back.interfaces["tip"].translation, body.interfaces["tip"].translation))
    np.testing.assert_allclose(back.S_bar * signs, body.S_bar, atol=1e-10)
    np.testing.assert_allclose(back.I_bar * signs, body.I_bar, atol=1e-10)
    text, _ = fem_text(mixed(body, np.eye(body.mode_count)[:, ::-1]))  # the highest first
    np.testing.assert_array_equal(read_fem(text.replace("ffrobot: ", ""), body.name)[0].frequency, body.frequency)


def mixed(body, T):
    """What `fem_text` asks for, in coordinates q, p = T q, which `ModalBody` does not take: a congruence with T."""
    at, names = body.stations, [item.name for item in dataclasses.fields(body)]
    return SimpleNamespace(**{name: getattr(body, name) for name in names} | {
        "mode_count": body.mode_count, "interpolate": body.interpolate, "begin": body.begin,
        "modal_mass": T.T @ T, "stiffness": T.T @ body.stiffness @ T,
        "S_bar": body.S_bar @ T, "I_bar": body.I_bar @ T,
        "S_bar_kl": np.einsum("abkl,km,ln->abmn", body.S_bar_kl, T, T),
        "interfaces": {name: Interface(end.position, end.translation @ T, end.rotation @ T)
                       for name, end in body.interfaces.items()},
        "stations": Stations(at.position, at.translation @ T, at.rotation @ T, at.height),
    })  # fmt: skip


def test_lumped_masses_of_a_fem_file(bodies):
    """Record 11 in place of 12 and 14 to 18: sums over nodes, exact for a body that is mass points."""
    points = random_cloud(np.random.default_rng(5), "cloud")
    body = bodies["cloud"]
    text, _ = fem_text(with_all_points(body, points))
    text = re.sub(r"\*\* RECORD GROUP 1[2-8],.*?(?=\*\* RECORD|\Z)", "", text, flags=re.DOTALL)
    rows = "\n".join(" ".join(map(repr, [m, m, m, 0.0, 0.0, 0.0])) for m in masses_in_order(text, points))
    back, remarks = read_fem(f"{text}** RECORD GROUP 11, LUMPED MASS\n{rows}\n", "cloud")
    keys = [key for key in vars(integrals_of(body)) if key != "damping"]
    assert max(differences(integrals_of(body), integrals_of(back), keys).values()) < 1e-10
    assert any("lumped masses" in line for line in remarks)


def test_damping_that_couples_modes_is_told(bodies):
    text, _ = fem_text(bodies["cloud"])
    changed = re.sub(r"(MODAL DAMPING MATRIX\n\S+) \S+", r"\g<1> 0.01", text)
    told = [any("couples modes" in line for line in read_fem(each, "cloud")[1]) for each in (text, changed)]
    assert told == [False, True]


def with_all_points(body, points):
    zero = np.zeros((3, body.mode_count))
    more = {f"p{k}": Interface(points.x[k], points.Phi[k], zero) for k in range(2, len(points.x))}
    root, tip = (Interface(points.x[k], points.Phi[k], zero) for k in (0, 1))
    stations = dataclasses.replace(
        body.stations, translation=points.Phi[:2], rotation=np.zeros_like(body.stations.rotation)
    )
    return dataclasses.replace(body, interfaces={"root": root, "tip": tip} | more, stations=stations)


def masses_in_order(text, points):
    """Mass of each node, found by its x coordinate in record 5."""
    x = np.array(re.search(r"RECORD GROUP 5,.*?\n(.*?)\*\*", text, re.DOTALL)[1].split(), dtype=float)
    return [float(points.mass[np.abs(points.x[:, 0] - value).argmin()]) for value in x]


@pytest.mark.parametrize("structure", [3, 2])
def test_the_other_dialect_of_sid(structure, bodies):
    """J as (3, 3), whole or by its upper triangle, and M1 as (row, column, mode)."""
    body = bodies["cloud"]
    text, _ = sid_text(body)
    turned = re.sub(r"m1\(\s*(\d+),\s*(\d+),\s*(\d+)\s*\)", r"m1(\1,\3,\2)", text)
    head, J, tail = re.split(r"(?s)(\n\s+J\n.*?end J\n)", turned, maxsplit=1)
    places = {1: (1, 1), 2: (2, 2), 3: (3, 3), 4: (1, 2), 5: (1, 3), 6: (2, 3)}
    J = re.sub(r"(structure +)= +3", rf"\1= {structure}", re.sub(r"(nrow +)= +6", r"\1= 3", J))
    lines = []
    for line in re.sub(r"(ncol +)= +1", r"\1= 3", J).splitlines():
        entry = re.match(r"\s+m([01])\(\s*(\d+),\s*1\s*(?:,(\s*\d+))?\) += (.*)", line)
        if entry is None:
            lines.append(line)
            continue
        a, b = places[int(entry[2])]
        mode = f",{entry[3]}" if entry[3] else ""
        lines += [f"m{entry[1]}({row},{column}{mode}) = {entry[4]}" for row, column in {(a, b), (b, a)}
                  if structure == 3 or row <= column]  # fmt: skip
    back, _ = read_sid(head + "\n".join(lines) + "\n" + tail, body.name)
    assert max(differences(integrals_of(body), integrals_of(back), vars(integrals_of(body))).values()) < EXACT


def test_axes_of_nodes_that_are_turned_are_told(bodies):
    """A_P of node 2, turned by 90° about z; interfaces have no axes of their own."""
    text, _ = sid_text(bodies["line"])
    head, node = re.split(r"(?=\n.*new node +=     2)", text, maxsplit=1)
    node = re.sub(
        r"m0\( 1, 1\)( +)=.*\n(.*)m0\( 2, 2\)( +)=.*", r"m0( 1, 2)\1= -1.0D0\n\2m0( 2, 1)\3= 1.0D0", node, count=1
    )
    turned, remarks = read_sid(head + node, "line")
    assert [text for text in remarks if text.startswith("AP: turned axes of nodes 2 are omitted")]
    assert not [line for line in read_sid(text, "line")[1] if line.startswith("AP")]
    assert differences(integrals_of(bodies["line"]), integrals_of(turned), ["S_bar"]) == {"S_bar": 0.0}


def test_craig_bampton_matrices(bodies, tmp_path):
    """K of rigid motions is zero, their kinetic energy is the body's, recovery moves stations rigidly."""
    content, _ = craig_bampton_file(bodies["held"])
    (tmp_path / "held.npz").write_bytes(content)
    file = np.load(tmp_path / "held.npz")
    origins, body = file["origins"], bodies["held"]
    fixed = len(file["M"]) - 6 * len(origins)
    assert fixed == body.eigenmode_count
    rigid = np.zeros((len(file["M"]), 6))
    for k, x in enumerate(origins):
        rigid[6 * k : 6 * k + 6] = np.eye(6)
        rigid[6 * k : 6 * k + 3, 3:] = np.cross(np.eye(3), x).T
    assert np.abs(file["K"] @ rigid).max() < 1e-9 * np.abs(file["K"]).max()
    assert np.sum(np.linalg.eigvalsh(file["K"]) > 1e-7 * np.abs(file["K"]).max() * 1e-3) == len(file["K"]) - 6
    inertia = rigid.T @ file["M"] @ rigid
    np.testing.assert_allclose(inertia[:3, :3], body.mass * np.eye(3), atol=1e-12)
    J = np.trace(body.second_moment) * np.eye(3) - body.second_moment + np.diag([body.J_spin, 0.0, 0.0])
    np.testing.assert_allclose(inertia[3:, 3:], J, atol=1e-12)
    moved = (file["recovery"] @ rigid).reshape(-1, 3, 6)
    np.testing.assert_allclose(moved[:, :, :3], np.broadcast_to(np.eye(3), moved[:, :, :3].shape), atol=1e-9)
    np.testing.assert_allclose(moved[:, :, 5], np.cross([0, 0, 1.0], file["points"]), atol=1e-9)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("family", ["all", ["in-plane-bending", "axial"]])
def test_craig_bampton_bodies_out_and_in(tmp_path, form, family):
    """The same modes, and the same matrices of interfaces and fixed-interface modes (but for signs of these)."""
    section = {"shape": "rectangle", "height": 0.02, "width": 0.013}
    link = HELD | {
        "geometry": {"kind": "beam", "length": 0.6, "section": section},
        "modes": {"count": 4, "family": family},
        "interface": [{"name": "middle", "position": 0.25}],
    }
    body = make_link(link).body
    write, read = FORMATS[form]
    write_modal_body(tmp_path / "back.h5", read(write(body)[0], "arm")[0])
    back = read_modal_body(tmp_path / "back.h5")
    assert back.reference_condition == "craig-bampton"
    assert back.residual.tolist() == body.residual.tolist()
    assert max(differences(body, back, KEPT).values()) < 1e-9
    first, second = craig_bampton(body), craig_bampton(back)
    order = [second.coordinates.index(name) for name in first.coordinates]
    for matrix, other in ((first.mass, second.mass), (first.stiffness, second.stiffness)):
        size = np.sqrt(np.abs(np.diag(matrix)).max())
        np.testing.assert_allclose(np.abs(other[np.ix_(order, order)]), np.abs(matrix), atol=1e-8 * size**2)


def test_craig_bampton_bodies_whose_interfaces_say_too_little(bodies):
    """More interfaces than modes can move by themselves: the root holds them all the same."""
    text, _ = sid_text(bodies["held"])
    named = "ffrobot: craig-bampton; root=1, tip=25, a=5, b=9"
    back, _ = read_sid(re.sub(r"ffrobot: craig-bampton; .*", named, text, count=1), "a")
    assert back.reference_condition == "cantilever"
    assert not back.residual.any()


def test_exudyn_matrices_are_those_of_its_own_assembly(bodies, tmp_path):
    """Of mass points: PsiTildeᵀ M Psi and its like, as EXUDYN computes them from nodes."""
    points = random_cloud(np.random.default_rng(5), "cloud")
    (tmp_path / "cloud.npz").write_bytes(exudyn_file(bodies["cloud"])[0])
    file = np.load(tmp_path / "cloud.npz", allow_pickle=True)
    n = len(points.stiffness)
    tilde = lambda a: np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])  # noqa: E731
    Psi = points.Phi.reshape(-1, n)
    PsiTilde = np.vstack([np.hstack([tilde(phi[:, mode]) for mode in range(n)]) for phi in points.Phi])
    xTilde, one = np.vstack([tilde(x) for x in points.x]), np.tile(np.eye(3), (len(points.x), 1))
    M = np.repeat(points.mass, 3)[:, None]
    expected = {
        "inertiaLocal": xTilde.T @ (M * xTilde), "mPsiTildePsi": PsiTilde.T @ (M * Psi),
        "mPsiTildePsiTilde": PsiTilde.T @ (M * PsiTilde), "mPhitTPsi": one.T @ (M * Psi),
        "mPhitTPsiTilde": one.T @ (M * PsiTilde), "mXRefTildePsi": xTilde.T @ (M * Psi),
        "mXRefTildePsiTilde": xTilde.T @ (M * PsiTilde), "massMatrixReduced": Psi.T @ (M * Psi),
        "chiU": points.mass @ points.x / points.mass.sum(),
    }  # fmt: skip
    for key, value in expected.items():
        np.testing.assert_allclose(file[key], value, atol=1e-12, err_msg=key)


def test_a_symmetric_part_in_both_integrals_is_left_out(bodies):
    """As PY_SID writes of plates: in C_r's M1 and twice in G_e, where geometric stiffness is not."""
    body = bodies["cloud"]
    text = sid_text(body)[0]
    # Entry (1, 2) about z and its mirror: of four modes those are m1(1, 2, 3) and m0(1, 10) = m0(1, 2 + 2·4).
    for name, entries, more in (
        ("Cr", ("m1( 1, 2, 3)", "m1( 2, 1, 3)"), 0.01),
        ("Ge", ("m0( 1,10)", "m0( 2, 9)"), 0.02),
    ):
        head, inside, tail = re.split(rf"(?s)(\n\s+{name}\n.*?end {name}\n)", text, maxsplit=1)
        for entry in entries:
            found = re.search(re.escape(entry) + r"\s*=\s*(\S+)", inside)
            value = float(found[1].replace("D", "E")) + more
            inside = inside[: found.start(1)] + f"{value:.16E}".replace("E", "D") + inside[found.end(1) :]
        text = head + inside + tail
    back, remarks = read_sid(text, body.name)
    assert any("Cr, Ge: both have a symmetric part, 0.01" in line for line in remarks)
    assert max(differences(integrals_of(body), integrals_of(back), vars(integrals_of(body))).values()) < 1e-11


@pytest.mark.parametrize("name", ["Ct", "Gr", "Ge"])
def test_integrals_that_contradict_each_other_are_told(name, bodies):
    head, inside, tail = re.split(rf"(?s)(\n\s+{name}\n.*?end {name}\n)", sid_text(bodies["cloud"])[0], maxsplit=1)
    _, remarks = read_sid(head + inside.replace("m0( 1, 2)", "m0( 1, 3)") + tail, "cloud")  # (1, 2) is left empty
    assert [text.split(":")[0] for text in remarks if " off " in text] == [name]


def test_modal_masses_of_few_digits():
    """A line of masses without inertia about its axis, shapes of five digits: sums are taken, and that is told."""
    n, x = 11, np.linspace(0.0, 1.0, 11)
    shape = "\n".join(f"0 0 {np.sin(np.pi * at):.5f} 0 0 0" for at in x)
    masses = "\n".join(f"{m} {m} {m} 0 0 0" for m in [0.1, *[0.2] * 9, 0.1])
    records = {1: f"REV0 {n} 1 0 0 0", 2: " ".join(map(str, range(n))), 3: "0", 4: "0", 5: "\n".join(map(str, x)),
               6: "0\n" * n, 7: "0\n" * n, 8: shape, 9: "1.", 10: "98.696", 11: masses}  # fmt: skip
    text = "".join(f"** RECORD GROUP {k}, TITLE\n{content}\n**\n" for k, content in records.items())
    body, remarks = read_fem(text, "beam")
    total = sum(m * float(f"{np.sin(np.pi * at):.5f}") ** 2 for m, at in zip([0.1, *[0.2] * 9, 0.1], x, strict=True))
    assert body.frequency[0] == pytest.approx(np.sqrt(98.696 / total) / (2 * np.pi), rel=1e-12)
    assert any("modal masses are sums over masses and shapes" in line for line in remarks)
    with pytest.raises(InputError, match="modal masses: expected the sums over masses and shapes"):
        read_fem(text.replace("\n1.\n", "\n1.2\n"), "beam")


def test_commands(tmp_path, ffrobot, refused, bodies):
    """Out and in again on the command line; what a format does not take is told."""
    write_modal_body(tmp_path / "arm.h5", bodies["line"])
    for file_format, name in (("sid", "arm.SID_FEM"), ("mbdyn", "arm.fem")):
        done = ffrobot.ok("export", "arm.h5", "--format", file_format, cwd=tmp_path)
        assert "not carried by" in done.stdout
        ffrobot.ok("import", name, "-o", f"{file_format}.h5", cwd=tmp_path)
        back = read_modal_body(tmp_path / f"{file_format}.h5")
        assert max(differences(bodies["line"], back, OF_LINES).values()) < EXACT
    for file_format, message in (
        ("craig-bampton", 'expected one with [reference] condition = "craig-bampton" in its link file'),
        ("csv", 'expected one of "sid", "mbdyn", "craig-bampton", "exudyn" of a modal body, found "csv"'),
    ):
        assert message in refused(tmp_path, "export", "arm.h5", "--format", file_format)
    told = refused(tmp_path, "export", "arm.h5", "--format", "craig-bampton", "-o", "none/arm.npz")  # before it is made
    assert "expected a file in a folder that exists, found no folder none" in told
