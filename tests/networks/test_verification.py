"""The verification network: a probability for each candidate, whatever stands beside it."""

import torch

from imop.networks.verification import EVIDENCE, INPUTS, RIVALRY, VerificationConfig, VerificationNetwork


def test_every_number_has_its_own_name():
    assert len(set(EVIDENCE)) == len(EVIDENCE)
    assert len(EVIDENCE) + 2 * len(RIVALRY) == INPUTS


def test_probabilities_do_not_depend_on_the_batch():
    torch.manual_seed(0)
    network = VerificationNetwork(VerificationConfig()).eval()
    evidence = torch.rand(7, INPUTS)
    together = network.probability(evidence)
    assert ((together > 0) & (together < 1)).all()
    torch.testing.assert_close(together[2:3], network.probability(evidence[2:3]))


def test_only_training_changes_what_is_standard():
    network = VerificationNetwork(VerificationConfig())
    before = network.standardized.mean.clone()
    network.eval()(torch.rand(5, INPUTS))
    torch.testing.assert_close(network.standardized.mean, before)
    network.train()(torch.rand(5, INPUTS))
    assert not torch.allclose(network.standardized.mean, before)
