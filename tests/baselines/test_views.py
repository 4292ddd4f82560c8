import numpy as np
import pytest
import torch

from imop.baselines.batch import batch_of
from imop.baselines.views import draw, heat_of, place_of
from imop.baselines.weights import make_network
from tests.baselines.conftest import TINY, some_samples


@pytest.mark.parametrize("size", [1.0, 0.3])
def test_heat_at_a_place_is_found_at_that_place(size):
    place = (torch.rand(6, 3, generator=torch.Generator().manual_seed(0)) - 0.5) * 0.9 * size
    found = place_of(heat_of(place, size, 32, 1.5).log(), size)
    assert (found - place).abs().max() < 0.15 * size / 32


def test_a_point_is_drawn_where_its_heat_is():
    place = torch.tensor([[0.11, -0.22, 0.33]])
    views = draw(place[:, None], torch.ones(1, 1, 3), 1.0, 16)
    drawn = views[:, :, 6].flatten(2).argmax(-1)
    assert torch.equal(drawn, heat_of(place, 1.0, 16, 1.0).flatten(2).argmax(-1))


def test_each_side_of_a_view_shows_what_is_nearest_to_it():
    points = torch.tensor([[[0.1, 0.1, z] for z in (0.0, 0.2, -0.3)]])
    colors = torch.tensor([[[c, 0.0, 0.0] for c in (0.1, 0.2, 0.3)]])
    top = draw(points, colors, 1.0, 8)[0, 2]
    row, column = torch.nonzero(top[6])[0]
    assert top[0, row, column] == pytest.approx(0.3) and top[7, row, column] == pytest.approx(0.2)


def test_drawing_follows_a_shift_by_whole_pixels():
    points = (torch.rand(1, 200, 3, generator=torch.Generator().manual_seed(1)) - 0.5) * 0.5
    colors = torch.rand(1, 200, 3, generator=torch.Generator().manual_seed(2))
    still, moved = draw(points, colors, 1.0, 16), draw(points + torch.tensor([1 / 16, 0, 0]), colors, 1.0, 16)
    assert torch.equal(moved[:, 2, :3, 1:], still[:, 2, :3, :-1])


def test_what_lies_outside_is_not_drawn():
    assert not draw(torch.full((1, 3, 3), 0.6), torch.ones(1, 3, 3), 1.0, 8).any()


def test_adapters_that_lead_nowhere_change_nothing():
    network = make_network("views", TINY["views"]).eval()
    inputs, _ = batch_of(some_samples(), np.arange(2))
    blocks, size = network.adapters
    nowhere = torch.randn(1, blocks, size)
    nowhere[..., size // 2 :] = 0
    plain, adapted = network.predict(inputs), network.predict(inputs, nowhere)
    assert torch.equal(plain.pose, adapted.pose)
    somewhere = network.predict(inputs, torch.randn(1, blocks, size))
    assert not torch.equal(plain.pose, somewhere.pose)
