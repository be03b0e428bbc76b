"""SceneObjects: the lists of all trees and spheres of a scene, made once, and the cache of derived values."""

import numpy as np
import pytest

import raytracer as rt
from raytracer.scene import scene_objects
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids.flattening import leaves, simplify
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import postfix
from raytracer.scene.solids.sphere import Sphere
from tests import scenes

A, B = rt.Sphere((0, 0, 0), 1), rt.Sphere((1, 2, 3), 0.5)
FLOOR = rt.Plane((0, 1, 0), 0)
MANY = rt.Instances((A | FLOOR) - ~B, [(0, 0, 0), (4, 0, 1), (9, 9, 9)], [1, 0.25, 3])
MIXED = MANY, A - B, FLOOR, ~~(A & ~B), MANY, rt.Instances(B, [(1, 1, 1)]), ~FLOOR


def test_one_list_has_all_trees_without_double_complements() -> None:
    objects = SceneObjects(MIXED)
    solids = [item.solid if isinstance(item, rt.Instances) else item for item in MIXED]
    assert [objects.tree(i) for i in range(len(MIXED))] == [*map(simplify, solids)]
    assert objects.tree(3) == postfix(A & ~B) and objects.counts() == [3, 1, 1, 1, 3, 1, 1]


def test_runs_are_instances_or_the_plain_solids_between_them() -> None:
    runs = [*SceneObjects(MIXED).runs()]
    assert [run.instances for run in runs] == [MANY, None, MANY, MIXED[5], None]
    assert runs[1].spheres == [A, B, A, B] and runs[1].planes == [FLOOR] and runs[4].planes == [FLOOR]
    (run,) = SceneObjects((A, B)).runs()
    assert run.nodes == [A, B]


def test_spheres_are_listed_in_the_order_of_the_solids() -> None:
    for scene in (scenes.lit_scene(*MIXED), scenes.lit_scene(FLOOR), scenes.lit_scene(A), scenes.random_scene(1)):
        spheres = [leaf for solid in scene.solids() for leaf in leaves(solid) if isinstance(leaf, Sphere)]
        objects = scene.objects
        assert isinstance(objects, SceneObjects)
        centers, radii = objects.spheres()
        np.testing.assert_array_equal(centers, np.array([s.center for s in spheres]).reshape(-1, 3))
        np.testing.assert_array_equal(radii, [s.radius for s in spheres])
        assert objects.spheres()[0] is centers


def test_a_value_is_derived_again_only_for_another_key() -> None:
    objects = SceneObjects((A,))
    made: list[int] = []

    def make() -> int:
        made.append(len(made))
        return made[-1]

    assert [objects.derive("a", key, make) for key in (1, 1, 2, 2, 1)] == [0, 0, 1, 1, 2]
    assert objects.derive("b", 1, make) == 3 and objects.derive("a", 1, make) == 2


@pytest.mark.parametrize("solid", [~A, ~(~A - ~B), ~(~FLOOR | ~~~B)])
def test_a_tree_has_at_most_four_nodes_for_each_leaf(solid: rt.Solid) -> None:
    tree = simplify(solid)
    assert len(tree) < scene_objects._NODES_PER_LEAF * sum(isinstance(node, Sphere | Plane) for node in tree)


def test_too_many_primitives_are_refused_before_all_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene_objects, "MAX_SURFACES", 6)
    assert len(SceneObjects((A, B, MANY.solid, A)).nodes) == 9
    with pytest.raises(rt.InputError, match=r"at most 6 primitives, got 11$"):
        SceneObjects((A, MANY, B))
    with pytest.raises(rt.InputError, match=r"at most 6 primitives, got at least 18$"):
        SceneObjects((A - B,) * 1000)
