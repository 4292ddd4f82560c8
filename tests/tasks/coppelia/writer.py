"""A writer of small CoppeliaSim models, so that tests of the reader need no foreign files."""

import heapq
import itertools
import struct
from collections import Counter

import numpy as np

IDENTITY_QX = (1, 0, 0, 0, 0, 0, 0)
IDENTITY_XQ = (0, 0, 0, 1, 0, 0, 0)


def ints(*values):
    return struct.pack(f"<{len(values)}i", *values)


def floats(*values):
    return struct.pack(f"<{len(values)}f", *values)


def doubles(*values):
    return struct.pack(f"<{len(values)}d", *values)


def text(value):
    raw = value.encode()
    return ints(len(raw)) + raw


def item(tag, payload=b""):
    return tag.encode() + ints(len(payload)) + payload


def section(*items):
    return b"".join(items) + b"EOO"


def common(
    name, handle, parent=-1, p=(0, 0, 0), q=(1, 0, 0, 0), extension="", layer=1, properties=4, more=()
):
    parts = [
        item("3do", b"\0\0\0"),
        item("Cfq", floats(*q, *p)),
        item("Ids", ints(handle, parent)),
        item("Nme", text(name)),
        item("Op2", ints(properties)),
        item("Lar", struct.pack("<H", layer)),
        item("Rst", text(extension)),
        *more,
    ]
    return b"".join(parts) + b"NXT"


def dummy(name, handle, parent=-1, base=False, **where):
    more = (item("Va2", bytes([1])),) if base else ()
    own = section(item("Dy2", floats(0.01)), item("Lli", ints(-1)))
    return item("DMY", common(name, handle, parent, more=more, **where) + own)


def joint(
    name, handle, parent, kind=11, q=0.0, low=0.0, extent=0.3, flags=0, force=1.0, spring=(0, 0), **where
):
    own = section(
        item("Jtt", ints(kind)),
        item("Va9", bytes([flags])),
        item("Pmr", floats(low, extent)),
        item("Prt", floats(q)),
        item("Jmd", ints(5)),
        item("Dmp", floats(0.0, force)),
        item("Spp", floats(*spring)),
        item("Dtp", floats(q)),
        item("Arg", floats(0.1, 0.02)),
    )
    return item("JNT", common(name, handle, parent, **where) + own)


def sensor(name, handle, parent, kind=0, sizes=(0, 0.08, 0.04, 0.02, 0.04, 0.02, 0.01, 0.01, 0), **where):
    volume = section(item("Snt", ints(kind)), item("Ss3", floats(*sizes)))
    own = section(item("Snt", ints(30)), item("Vod", volume), item("Pr4", bytes([0])))
    return item("SNR", common(name, handle, parent, **where) + own)


def path(name, handle, parent, points, bezier=(0.0, 0.0, 1), **where):
    def corner(p):
        return item("Pat", section(item("At2", floats(*p, 1, 0, 0, 0, *bezier[:2]) + ints(bezier[2]))))

    own = section(item("Ntp", section(item("At2", ints(0)), *(corner(p) for p in points))))
    return item("PAT", common(name, handle, parent, **where) + own)


def box_mesh(size=(0.1, 0.1, 0.1)):
    """Vertices (8, 3) and triangles (12, 3) of a cuboid."""
    v = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * size
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return v, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def color(rgb):
    return section(item("Cl3", floats(*rgb, *([0] * 12))), item("Trf", floats(1.0)), item("Var", bytes([4])))


def leaf(mesh_number=0, primitive=3, size=(0.1, 0.1, 0.1), rgb=(1, 0, 0), more=(), p=(0, 0, 0), flags=0):
    mesh = section(
        item("Cl0", color(rgb)),
        item("Vev", ints(mesh_number)),
        item("Inv", ints(mesh_number)),
        item("Ppr", ints(primitive) + floats(*size)),
        item("Ppf", floats(*p, 1, 0, 0, 0)),
        item("Var", bytes([flags])),
        *more,
    )
    return wrapper() + mesh


def wrapper(mass=0.5, moments=(1e-3, 1e-3, 1e-3), *children):
    return section(
        item("Nme", text("")),
        item("Mas", floats(mass)),
        item("Ine", floats(*IDENTITY_XQ, *moments)),
        *children,
    )


def shape(
    name,
    handle,
    parent=-1,
    geometry=None,
    dynamic=False,
    respondable=True,
    mask=0xFFFF,
    **where,
):
    content = item("Gst", leaf()) if geometry is None else geometry
    own = section(
        item("Ge2", section(content)),
        item("Dc2", struct.pack("<H", mask)),
        item("Sss", bytes([0x80 if dynamic else 0])),
        item("Ss3", bytes([int(respondable)])),
    )
    return item("SHP", common(name, handle, parent, **where) + own)


def arrays(*meshes):
    """The shared lists: of every mesh its vertices and its triangles, plain."""
    parts = []
    for vertices, triangles in meshes:
        parts.append(item("Ver", floats(*np.asarray(vertices).ravel())))
        parts.append(item("Ind", ints(*(int(i) for i in np.asarray(triangles).ravel()))))
    return item("VIN", section(*parts))


def packed(values):
    """Integers as differences of one to four bytes."""
    out, before = ints(len(values)), 0
    for value in values:
        n = 0
        while True:
            bias = (31, 8191, 2097151, 536870911)[n]
            raw = value - before + bias
            if 0 <= raw < 1 << (6 + 8 * n):
                break
            n += 1
        out += bytes([(n << 6) | (raw & 63)]) + bytes((raw >> (6 + 8 * i)) & 255 for i in range(n))
        before = value
    return out


def texture(number, pixels):
    """A picture (h, w, 3) uint8."""
    h, w = pixels.shape[:2]
    parts = (item("Ipa", ints(number, w, h)), item("Gon", text("picture")), item("Bst", b"\0"))
    return item("TEX", section(*parts, item("Img", pixels.tobytes())))


def body(*items):
    return b"".join(items) + b"EOF"


def header(size, packed_=False, version=22):
    start = b"VREP" + ints(version, 15) + bytes([int(packed_)]) + ints(size)
    return start + bytes(1021 - len(start))


def ttm(*items, compress=False):
    raw = body(*items)
    return header(len(raw), compress) + (huffman(raw) if compress else raw)


def huffman(data):
    """Tree and codes of `data`, as the program writes them."""
    bits = []
    codes = _codes(data, bits)
    for byte in data:
        bits += codes[byte]
    return np.packbits(np.array(bits, dtype=np.uint8)).tobytes()


def _codes(data, bits):
    counts = Counter(data)
    heap = [(n, symbol, symbol) for symbol, n in sorted(counts.items())]
    heapq.heapify(heap)
    for serial in itertools.count(256):
        if len(heap) == 1:
            break
        (a, _, left), (b, _, right) = heapq.heappop(heap), heapq.heappop(heap)
        heapq.heappush(heap, (a + b, serial, (left, right)))
    codes = {}

    def write(node, code):
        if isinstance(node, tuple):
            bits.append(0)
            write(node[0], [*code, 0])
            write(node[1], [*code, 1])
        else:
            bits.append(1)
            bits.extend((node >> (7 - i)) & 1 for i in range(8))
            codes[node] = code or [0]

    write(heap[0][2], [])
    return codes
