"""What was learned stays when evidence is added, and only how the new enters is trained then."""

import numpy as np
import pytest
import torch

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.networks.verification import EVIDENCE, VerificationConfig, VerificationNetwork, directions
from imop.training.recipes.widen import widen, widened
from imop.training.verification.cases import Cases
from imop.training.verification.fit import VerificationTraining, fit

NEW = ("claimed", "turned_color", "palette")


def test_known_columns_keep_their_weights_and_what_follows_stays_last():
    old, fresh = torch.arange(10.0).reshape(2, 5), torch.full((2, 7), -1.0)
    found = widened(fresh, old, (0, 3))
    assert found.tolist() == [[0, -1, -1, 1, 2, 3, 4], [5, -1, -1, 6, 7, 8, 9]]


def network():
    torch.manual_seed(0)
    return VerificationNetwork(VerificationConfig()).eval()


def narrowed(weights):
    """What a network that does not know the new evidence would have."""
    signs = directions()
    old = [name not in NEW for name in EVIDENCE]
    directed, free = ([i for i, sign in enumerate(signs) if bool(sign) == has] for has in (True, False))
    result = {}
    for name, tensor in weights.items():
        columns = list(range(tensor.shape[-1])) if tensor.ndim else []
        if "standardized" in name and tensor.ndim:
            columns = [i for i in columns if old[i]]
        elif name.endswith("situation.0.weight"):
            columns = [k for k, i in enumerate(free) if old[i]]
        elif name.endswith("weights.0"):
            columns = [k for k, i in enumerate(directed) if old[i]] + columns[len(directed) :]
        result[name] = tensor[..., columns] if tensor.ndim else tensor
    return result


def test_a_network_that_is_narrowed_and_widened_is_the_same_but_for_the_new_evidence():
    model, fresh = network(), VerificationNetwork(VerificationConfig()).state_dict()
    former = narrowed(model.state_dict())
    assert former["standardized.mean"].shape == (len(EVIDENCE) - len(NEW),)
    again = widen(former, fresh, NEW)
    new = [i for i, name in enumerate(EVIDENCE) if name in NEW]
    for name, tensor in model.state_dict().items():
        same = again[name] == tensor
        assert again[name].shape == tensor.shape and same.float().mean() > 0.9, name
    assert torch.equal(again["standardized.mean"][new], fresh["standardized.mean"][new])


def test_unknown_evidence_is_named():
    with pytest.raises(InvalidInput, match="nonsense"):
        widen({}, {}, ("nonsense",))


def cases(rng):
    """Two candidates each; the one that is claimed by something else is wrong."""
    evidence = rng.normal(size=(200, len(EVIDENCE))).astype(np.float32)
    right = np.tile([True, False], 100)
    evidence[:, EVIDENCE.index("claimed")] = np.where(right, 0.0, 1.0)
    goals = np.tile(se3.make(p=np.array([[0.0, 0, 0], [0.5, 0, 0]])), (100, 1, 1)).astype(np.float32)
    return Cases(evidence, goals, np.where(right, 0.1, 9.0).astype(np.float32), np.repeat(np.arange(100), 2))


def test_only_the_entrance_of_new_evidence_is_trained_and_it_is_learned(tmp_path):
    model = network()
    before = {name: tensor.clone() for name, tensor in model.state_dict().items()}
    config = VerificationTraining((), tmp_path, only=("claimed",), steps=150, learning_rate=0.05, dropout=0.0)
    reached = fit(model, cases(np.random.default_rng(0)), config)
    assert reached["right"] > 0.8
    column = EVIDENCE.index("claimed")
    place = [i for i, sign in enumerate(directions()) if sign].index(column)
    for name, tensor in model.state_dict().items():
        changed = (tensor != before[name]).nonzero()[:, -1:].unique().tolist()
        assert changed in ([], [place] if name.endswith("weights.0") else [column]), name
