from pathlib import Path

import imop
from imop.networks.model import BUNDLED, load_model
from imop.reproduce.origin import code, commit, parameters, weight_files


def test_parameters_are_those_of_the_networks_and_a_few_scales_of_inputs():
    trained = sum(load_model(BUNDLED).parameter_table().values())
    assert trained <= parameters("learned", None) < 1.002 * trained
    assert parameters("replay", None) is None
    assert parameters("learned", Path("no/such/folder")) is None


def test_a_regressor_has_a_file_for_each_of_its_networks():
    assert [file.parent.name for file in weight_files("rvt_hdt", Path("some"))] == ["views", "views_hdt"]
    assert weight_files("rvt", None)[0].parts[:2] == ("runs", "baselines")


def test_the_code_is_told_by_a_digest_and_a_commit_if_there_is_one():
    assert len(code()) == 12
    in_checkout = (Path(imop.__file__).parents[2] / ".git").exists()
    assert bool(commit()) == in_checkout
