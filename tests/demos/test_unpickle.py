import io
import os
import pickle
import tracemalloc
import types

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


class Numpy1(pickle._Pickler):
    """Writes what numpy 2 calls numpy._core as numpy 1 does."""

    def save_global(self, obj, name=None):
        if not obj.__module__.startswith("numpy._core"):
            return super().save_global(obj, name)
        module = obj.__module__.replace("_core", "core")
        self.write(f"c{module}\n{obj.__name__}\n".encode())
        self.memoize(obj)

    dispatch = {**pickle._Pickler.dispatch, types.FunctionType: save_global}  # noqa: RUF012


VALUES = [
    np.float64(1.5),
    np.float32(0.25),
    np.int64(-3),
    np.bool_(True),
    np.str_("über"),
    np.arange(6.0).reshape(2, 3),
    np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    np.arange(24).reshape(2, 3, 4).transpose(1, 0, 2),
    np.arange(4, dtype=">i2"),
    np.array(True),
    np.zeros(0),
    np.array(["a", "bcd"]),
]


@pytest.mark.parametrize("value", VALUES, ids=repr)
@pytest.mark.parametrize("protocol", range(2, 6))
@pytest.mark.parametrize("numpy_1", [True, False])
def test_numbers_and_arrays_of_numpy_in_every_protocol(tmp_path, value, protocol, numpy_1):
    stream = io.BytesIO()
    (Numpy1 if numpy_1 else pickle.Pickler)(stream, protocol).dump({"a": [value, value]})
    path = tmp_path / "a.pkl"
    path.write_bytes(stream.getvalue())
    for read in unpickle.load(path)["a"]:
        assert np.asarray(read).dtype.str[1:] == np.asarray(value).dtype.str[1:]  # but for the order of bytes
        np.testing.assert_array_equal(read, value)


HUGE = 10**9


def forged(function, *arguments):
    """A pickle that calls a function of numpy with arguments that numpy itself never writes."""
    return pickle.dumps(Evil(function, *arguments))


@pytest.mark.parametrize(
    "content",
    [
        forged(np.ndarray, (HUGE,)),
        forged(np.empty(0).__reduce__()[0], np.ndarray, (HUGE,), b"d")[:-1] + b"K\x01b.",
        forged(np.float64(0).__reduce__()[0], np.dtype("V2000000000")),
        forged(np.dtype, "O"),
        forged(np.dtype, [("a", "O")]),
        b"\x80\x04Nr\xff\xff\xff\x3f.",  # puts an object in place 2^30 of the memo
        b"\x80\x05\x96" + (2**40).to_bytes(8, "little") + b".",  # a bytearray of 1 TB
        b"\x80\x04\x8e" + (2**40).to_bytes(8, "little") + b".",  # bytes of 1 TB
    ],
)
def test_forged_sizes_and_types_cost_no_memory(tmp_path, content):
    path = tmp_path / "a.pkl"
    path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(CorruptData):
        unpickle.load(path)
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()


def test_pointer_of_git_lfs(tmp_path):
    path = tmp_path / "a.pkl"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    with pytest.raises(CorruptData, match=r"git LFS.*remedy.*git lfs pull"):
        unpickle.load(path)


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
