"""The scene of what still stands of the planar wing; it goes with that."""

from .spatial import SpatialScene as Scene
from .spatial import SpatialSceneKeys as SceneKeys

__all__ = ["Scene", "SceneKeys"]
