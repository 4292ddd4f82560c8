"""Clusters on the table."""

import numpy as np

from imop.geometry.cloud import concatenate
from imop.geometry.clusters import connected, find_objects
from imop.geometry.perception import supporting_plane
from tests.policy.scenes import RED, TABLE, at, box, table


def objects_of(cloud):
    return find_objects(cloud, supporting_plane(cloud))


def test_every_box_is_one_object_and_the_table_none():
    boxes = [box((0.04, 0.04, 0.04), RED, at(x, 0.1)) for x in (0.0, 0.1, 0.2)]
    found = objects_of(concatenate([table(), *boxes]))
    assert len(np.unique(found.labels)) == 3
    assert found.height.min() > 0.005
    np.testing.assert_allclose(found.height, found.cloud.points[:, 2] - TABLE, atol=1e-6)
    for label in range(3):
        assert np.ptp(found.cloud.points[found.labels == label], axis=0).max() < 0.05


def test_boxes_that_touch_are_one_object():
    boxes = [box((0.04, 0.04, 0.04), RED, at(x, 0.1)) for x in (0.0, 0.05)]
    assert len(np.unique(objects_of(concatenate([table(), *boxes])).labels)) == 1


def test_specks_are_dropped():
    thing = box((0.04, 0.04, 0.04), RED, at(0.0, 0.1))
    speck = thing.select(np.arange(3))
    speck = type(speck)(speck.points + np.array([0.3, 0, 0.2]), speck.colors, speck.camera, speck.normals)
    found = objects_of(concatenate([table(), thing, speck]))
    assert found.cloud.points[:, 0].max() < 0.1


def test_bare_table_is_the_only_object():
    found = objects_of(table())
    assert len(found) == len(table()) and set(found.labels) == {0}


def test_no_points_have_no_labels():
    assert connected(np.zeros((0, 3))).shape == (0,)
