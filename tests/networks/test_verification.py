"""The verification network: a probability for each candidate, beside its rivals."""

import torch

from imop.networks.verification import EVIDENCE, VerificationConfig, VerificationNetwork, directions

K = len(EVIDENCE)


def network(seed=0):
    torch.manual_seed(seed)
    return VerificationNetwork(VerificationConfig(members=2)).eval()


def some(count, seed=0):
    """Evidence of some candidates, and which of them act elsewhere."""
    torch.manual_seed(seed)
    rival = torch.rand(count, count) < 0.5
    return 0.3 * torch.randn(count, K), rival & rival.T & ~torch.eye(count, dtype=torch.bool)


def test_every_number_has_its_own_name():
    assert len(set(EVIDENCE)) == len(EVIDENCE) == len(directions())


def test_probabilities_do_not_depend_on_the_order():
    judge, (evidence, rival) = network(), some(7)
    together, order = judge.probability(evidence, rival), torch.randperm(7)
    assert ((together > 0) & (together < 1)).all()
    torch.testing.assert_close(
        judge.probability(evidence[order], rival[order][:, order]), together[order], rtol=1e-4, atol=1e-6
    )


def test_cases_are_judged_together_as_they_are_alone():
    judge, (evidence, rival), (fewer, beside) = network(), some(5), some(3, seed=1)
    filled = torch.full((2, 5, K), torch.nan)
    filled[0], filled[1, :3] = evidence, fewer
    rivals, real = torch.ones(2, 5, 5, dtype=torch.bool), torch.zeros(2, 5, dtype=torch.bool)
    rivals[0], rivals[1, :3, :3] = rival, beside
    real[0], real[1, :3] = True, True
    p = torch.sigmoid(judge(filled, rivals, real)).mean(dim=0)
    torch.testing.assert_close(p[0], judge.probability(evidence, rival))
    torch.testing.assert_close(p[1, :3], judge.probability(fewer, beside))


def test_what_speaks_for_a_candidate_never_makes_it_less_likely_and_the_reverse():
    judge, (evidence, rival), signs = network(1), some(40), torch.tensor(directions())
    known = dict(zip(EVIDENCE, signs.tolist(), strict=True))
    assert known["near_loose"] == known["around_backward"] == 1 and known["palm"] == known["goal_clash"] == -1
    assert known["backward_size"] == known["matches_sure"] == known["near_spread"] == known["tilt"] == 0
    evidence, real = 10 * evidence, torch.ones(len(rival), len(rival), dtype=torch.bool)
    # One case for each candidate, in which more speaks for that one alone.
    cases, rivals = (x.expand(len(rival), *x.shape) for x in (evidence, rival))
    before = judge(cases, rivals, real).diagonal(dim1=1, dim2=2)
    own = torch.eye(len(rival))
    for k in signs.nonzero()[:, 0].tolist():
        more = cases.clone()
        more[..., k] += 2.0 * signs[k] * torch.rand(len(rival)) * own
        assert (judge(more, rivals, real).diagonal(dim1=1, dim2=2) >= before - 1e-5).all()
    assert (judge(cases + 5.0 * signs, rivals, real).diagonal(dim1=1, dim2=2) > before).any()


def test_a_rival_that_more_speaks_for_makes_no_candidate_likelier():
    judge, (evidence, rival), signs = network(2), some(12), torch.tensor(directions())
    before, more = judge.probability(evidence, rival), evidence.clone()
    more[0] += 3.0 * signs
    after = judge.probability(more, rival)
    assert (after[1:] <= before[1:] + 1e-6).all() and (after[1:] < before[1:] - 1e-4).any()
    assert after[0] >= before[0]


def test_only_training_changes_what_is_standard():
    judge = VerificationNetwork(VerificationConfig())
    before = judge.standardized.mean.clone()
    case = torch.rand(1, 5, K), torch.zeros(1, 5, 5, dtype=torch.bool), torch.ones(1, 5, dtype=torch.bool)
    judge.eval()(*case)
    torch.testing.assert_close(judge.standardized.mean, before)
    judge.train()(*case)
    assert not torch.allclose(judge.standardized.mean, before)
