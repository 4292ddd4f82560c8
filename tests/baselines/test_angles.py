import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from imop.baselines.angles import angles_of, likeliest, rotations_of, shares_of
from imop.geometry import se3


def test_angles_come_back_from_shares_of_classes():
    R = torch.from_numpy(Rotation.random(50, random_state=0).as_matrix()).float()
    back = rotations_of(likeliest((shares_of(angles_of(R)) + 1e-9).log()))
    assert np.degrees(se3.rotation_distance(_poses(back), _poses(R))).max() < 6


@pytest.mark.parametrize("turn", [-2.0, 0.3, 3.0])
@pytest.mark.parametrize("sign", [-1, 1])
def test_near_the_pole_noise_does_not_change_the_angles_much(sign, turn):
    exact = se3.euler(0, sign * np.pi / 2, turn)
    noisy = se3.euler(0.01, -0.01, 0.02) @ exact
    angles = angles_of(torch.from_numpy(np.stack([exact, noisy])))
    apart = (angles[0] - angles[1] + np.pi) % (2 * np.pi) - np.pi
    assert apart.abs().max() < 0.05
    assert np.degrees(se3.rotation_distance(_poses(rotations_of(angles))[0], se3.make(exact))) < 0.1


def test_shares_are_distributions_around_the_circle():
    shares = shares_of(torch.tensor([[np.pi, -np.pi, 0.0], [3.1415, -3.1, 1.0]]))
    torch.testing.assert_close(shares.sum(-1), torch.ones(2, 3))
    assert shares[0, 0].argmax() == shares[0, 1].argmax()


def _poses(R):
    return se3.make(R.double().numpy())
