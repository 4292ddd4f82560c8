import os
import pickle

import numpy as np
import pytest

from imop.demos import unpickle
from imop.errors import CorruptData
from tests.demos.rlbench_files import dump_demo


class Evil:
    def __init__(self, function, *arguments):
        self.call = (function, arguments)

    def __reduce__(self):
        return self.call


def test_reads_arrays_and_objects(tmp_path):
    path = tmp_path / "low_dim_obs.pkl"
    array = np.arange(12.0).reshape(3, 4)
    dump_demo(path, [{"a": array, "b": np.array(True), "c": {"d": 1.5}}])
    demo = unpickle.load(path)
    assert isinstance(demo, unpickle.DemoRecord)
    (observation,) = demo.fields["_observations"]
    np.testing.assert_array_equal(observation.fields["a"], array)
    assert observation.fields["b"].item() is True and observation.fields["c"] == {"d": 1.5}


def test_names_of_numpy_1_and_2(tmp_path):
    path = tmp_path / "a.pkl"
    new = pickle.dumps(np.arange(5), protocol=3)
    old = new.replace(b"numpy._core.multiarray", b"numpy.core.multiarray")
    for content in (new, old):
        path.write_bytes(content)
        np.testing.assert_array_equal(unpickle.load(path), np.arange(5))
    assert b"numpy._core" in new and b"numpy._core" not in old


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize("wrap", [lambda x: x, lambda x: [1, {"k": x}]])
def test_os_system_is_refused_and_not_called(tmp_path, protocol, wrap):
    path, proof = tmp_path / "low_dim_obs.pkl", tmp_path / "proof"
    path.write_bytes(pickle.dumps(wrap(Evil(os.system, f"touch {proof}")), protocol=protocol))
    with pytest.raises(CorruptData, match=r"posix\.system|os\.system") as caught:
        unpickle.load(path)
    assert caught.value.path == path
    assert not proof.exists()


@pytest.mark.parametrize("function", [eval, exec, getattr, __import__, np.load, np.fromfile, np.memmap, open])
def test_everything_else_is_refused(tmp_path, function):
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps(Evil(function, "1")))
    with pytest.raises(CorruptData, match="asks for"):
        unpickle.load(path)


def test_literal_name_os_system(tmp_path):
    path = tmp_path / "a.pkl"
    path.write_bytes(b"cos\nsystem\n(S'touch /tmp/imop_must_not_exist'\ntR.")
    with pytest.raises(CorruptData, match=r"os\.system"):
        unpickle.load(path)


def test_stand_ins_cannot_be_changed_by_a_pickle(tmp_path):
    path = tmp_path / "a.pkl"
    # BUILD with the class itself as the object: would set attributes of the class for good.
    path.write_bytes(b"crlbench.demo\nDemo\n(N}S'planted'\nI1\nstb.")
    with pytest.raises(CorruptData):
        unpickle.load(path)
    assert not hasattr(unpickle.DemoRecord, "planted")


@pytest.mark.parametrize("content", [b"", b"\x80\x04", b"not a pickle", b"\x80\x04]\x94(K\x01"])
def test_damaged(tmp_path, content):
    path = tmp_path / "a.pkl"
    path.write_bytes(content)
    with pytest.raises(CorruptData, match="not a readable pickle"):
        unpickle.load(path)


def test_truncated_anywhere(tmp_path):
    path = tmp_path / "a.pkl"
    dump_demo(path, [{"a": np.arange(3.0)}])
    content = path.read_bytes()
    for n in range(len(content)):
        path.write_bytes(content[:n])
        with pytest.raises(CorruptData):
            unpickle.load(path)


def test_missing(tmp_path):
    with pytest.raises(CorruptData, match="missing"):
        unpickle.load(tmp_path / "a.pkl")
