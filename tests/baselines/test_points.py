import torch

from imop.baselines.blocks import Block, Rotary
from imop.baselines.points import PointsConfig, sample_ghosts, upright

CONFIG = PointsConfig()
PLACE = torch.tensor([[0.2, -0.1, 0.3], [-0.4, 0.4, -0.45]])


def test_ghost_points_of_every_stage_lie_around_the_target():
    torch.manual_seed(0)
    for stage, near in enumerate((0.1, 0.05, 0.02)):
        for _ in range(20):
            ghosts = sample_ghosts(PLACE, stage, CONFIG, CONFIG.ghosts, miss=True)
            assert (ghosts - PLACE[:, None]).norm(dim=-1).amin(1).max() < near


def test_each_stage_samples_a_smaller_part_of_space():
    torch.manual_seed(0)
    spread = [(sample_ghosts(PLACE, s, CONFIG, 500) - PLACE[:, None]).norm(dim=-1).max() for s in range(3)]
    assert spread[0] > spread[1] > spread[2] and spread[2] <= CONFIG.radii[1] + 1e-6
    assert sample_ghosts(PLACE, 0, CONFIG, 500).abs().max() <= 0.5


def test_attention_depends_on_relative_positions_only():
    torch.manual_seed(0)
    block, rotary = Block(48, 2).eval(), Rotary(24)
    x, context, ghosts, places = (torch.randn(1, n, c) for n, c in ((3, 48), (5, 48), (3, 3), (5, 3)))
    shift = torch.tensor([0.3, -0.2, 0.1])
    here = block(x, context, (rotary(ghosts), rotary(places)))
    there = block(x, context, (rotary(ghosts + shift), rotary(places + shift)))
    apart = block(x, context, (rotary(ghosts + shift), rotary(places)))
    torch.testing.assert_close(here, there, atol=1e-4, rtol=1e-4)
    assert not torch.allclose(here, apart, atol=1e-3)


def test_columns_become_a_rotation():
    R = upright(torch.randn(10, 2, 3, generator=torch.Generator().manual_seed(0)))
    torch.testing.assert_close(R @ R.transpose(1, 2), torch.eye(3).expand(10, 3, 3), atol=1e-5, rtol=0)
    torch.testing.assert_close(torch.linalg.det(R), torch.ones(10))
    torch.testing.assert_close(upright(R[:, :, :2].transpose(1, 2)), R)
