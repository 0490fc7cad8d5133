"""Whether the links and joints of a URDF form one tree, and mimic joints lead somewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...common.errors import InputError, did_you_mean, quoted
from ...common.tables import shown
from .robot import UrdfJoint


def root_of(links: Sequence[str], joints: Sequence[UrdfJoint]) -> str:
    """The one link that no joint carries.

    Raises:
        InputError: a joint names a link that does not exist, a link has two parents, there is more than one tree.
    """
    if not links:
        raise InputError("expected at least one <link>, found none")
    carried = dict[str, str]()
    for joint in joints:
        label = f'joint "{shown(joint.name)}"'
        for kind, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise InputError(f'{label}: <{kind}>: expected a link of the file, found "{shown(name)}"'
                                 + did_you_mean(name, links))  # fmt: skip
        if joint.child in carried:
            raise InputError(
                f'{label}: expected one joint that carries link "{shown(joint.child)}", found a second one, "'
                f'{shown(carried[joint.child])}" being the first: URDF has trees only; close the loop in the scene'
            )
        carried[joint.child] = joint.name
    roots = [name for name in links if name not in carried]
    if not roots:
        raise InputError("expected one link that no joint carries, found none: the joints form a circle")
    if len(roots) > 1:
        raise InputError(
            f"expected one link that no joint carries, found {len(roots)}: {quoted(roots)}; join them by fixed joints"
        )
    _check_reached(roots[0], links, joints)
    return roots[0]


def _check_reached(root: str, links: Sequence[str], joints: Sequence[UrdfJoint]) -> None:
    """Links with a parent each, but not below the root, form circles."""
    reached, todo = {root}, [root]
    while todo:
        link = todo.pop()
        below = [joint.child for joint in joints if joint.parent == link]
        reached.update(below)
        todo += below
    if left := [name for name in links if name not in reached]:
        raise InputError(f'expected all links to be carried by "{shown(root)}", found a circle of {quoted(left)}')


def check_mimics(joints: Mapping[str, UrdfJoint]) -> None:
    """Raise `InputError` where a mimic joint follows one that does not exist, or in the end itself."""
    for joint in joints.values():
        label, chain = f'joint "{shown(joint.name)}": <mimic>', [joint.name]
        while (follows := joints[chain[-1]].mimic) is not None:
            if follows.joint not in joints:
                raise InputError(f'{label}: expected a joint of the file, found "{shown(follows.joint)}"'
                                 + did_you_mean(follows.joint, joints))  # fmt: skip
            if follows.joint in chain:
                raise InputError(
                    f"{label}: expected a joint that moves freely at the end of the chain, found a circle:"
                    f" {' → '.join([*chain, follows.joint])}"
                )
            chain.append(follows.joint)
