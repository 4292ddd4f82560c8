"""The verification network: a probability for each candidate, whatever stands beside it."""

import torch

from imop.networks.verification import (
    EVIDENCE,
    INPUTS,
    RIVALRY,
    VerificationConfig,
    VerificationNetwork,
    directions,
)


def test_every_number_has_its_own_name():
    assert len(set(EVIDENCE)) == len(EVIDENCE)
    assert len(EVIDENCE) + 2 * len(RIVALRY) == INPUTS


def test_probabilities_do_not_depend_on_the_batch():
    torch.manual_seed(0)
    network = VerificationNetwork(VerificationConfig()).eval()
    evidence = 0.3 * torch.randn(7, INPUTS)
    together = network.probability(evidence)
    assert ((together > 0) & (together < 1)).all()
    torch.testing.assert_close(together[2:3], network.probability(evidence[2:3]))


def test_what_speaks_for_a_candidate_never_makes_it_less_likely_and_the_reverse():
    torch.manual_seed(1)
    network = VerificationNetwork(VerificationConfig()).eval()
    evidence, signs = 3 * torch.randn(200, INPUTS), torch.tensor(directions())
    known = dict(zip(EVIDENCE, signs.tolist(), strict=False))
    assert known["near_loose"] == known["around_backward"] == 1 and known["palm"] == known["goal_clash"] == -1
    assert known["backward_size"] == known["matches_sure"] == known["near_spread"] == known["tilt"] == 0
    before = network(evidence)
    for k in signs.nonzero()[:, 0].tolist():
        more = evidence.clone()
        more[:, k] += 2.0 * signs[k] * torch.rand(200)
        assert (network(more) >= before - 1e-5).all()
    assert (network(evidence + 5.0 * signs) > before).any()


def test_only_training_changes_what_is_standard():
    network = VerificationNetwork(VerificationConfig())
    before = network.standardized.mean.clone()
    network.eval()(torch.rand(5, INPUTS))
    torch.testing.assert_close(network.standardized.mean, before)
    network.train()(torch.rand(5, INPUTS))
    assert not torch.allclose(network.standardized.mean, before)
