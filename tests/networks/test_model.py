import pytest
import torch

from imop.networks.model import PAPER, SMALL, Model


def test_the_paper_size_has_80_8_million_parameters():
    with torch.device("meta"):
        total = sum(Model(PAPER).parameter_table().values())
    assert total == pytest.approx(80.8e6, rel=0.02)


def test_the_small_size_is_small():
    with torch.device("meta"):
        assert sum(Model(SMALL).parameter_table().values()) < 2e6
