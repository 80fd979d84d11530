"""Files that somebody changed: of every kind of result, in every way, as many as are asked for.

``python -m tests.hard.damaged 1000`` prints the table.  A file is changed in its bytes or in the members of its archive, without
its header knowing (what is loaded then is what was saved), or is written anew with a changed header or array (a record that
vouches for itself, which its class must read or refuse).  Bad is whatever is no `FileFormatError` that names the file in one line,
takes more than a second or 200 MB, or is other content.
"""

import json
import math
import sys
import tempfile
import time
import tracemalloc
import warnings
import zipfile
import zlib
from collections import Counter
from io import BytesIO
from pathlib import Path

import numpy as np

import bifurc as bf
from bifurc import io
from tests.test_loading import MADE, REGION, A, branch

SECONDS, MEMORY = 1.0, 200e6
HEADER = "__header__.npy"


def curve():
    start = branch().special_points[0]
    return bf.trace_curve(start, ("omega", "amplitude"), {"omega": (1.2, 1.41), "amplitude": (0.5, 0.55)}, max_steps=8)


# every kind that `load` knows, but "harmonic_orbit" (a series), "stretch_certificate" (in "proofs")
KINDS = {
    **MADE,
    "curve": curve,
    "atlas": lambda: bf.atlas(A, "omega", (1.4, 1.41), REGION, probes=2, samples=8),
    "point": lambda: branch().special_points[0].certify(),
    "proofs": lambda: bf.trace(bf.find_orbit(A), "omega", bounds=(1.399, 1.401), max_steps=4).certify(),
}


# ---- bytes ---------------------------------------------------------------------------------------------------------------


def cut(rng, whole):
    return whole[: int(rng.integers(len(whole)))]


def flipped(rng, whole):
    """One to eight bits, anywhere."""
    changed = bytearray(whole)
    for place in rng.integers(len(whole), size=int(rng.integers(1, 9))):
        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def flipped_in_lists(rng, whole):
    """A bit of what the archive says of its members, there or beside them."""
    marks = [k for mark in (b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06", b"\x93NUMPY") for k in places(whole, mark)]
    changed = bytearray(whole)
    place = min(marks[int(rng.integers(len(marks)))] + int(rng.integers(60)), len(whole) - 1)
    changed[place] = int(rng.integers(256))
    return bytes(changed)


def overwritten(rng, whole):
    start, length = int(rng.integers(len(whole))), int(rng.integers(1, 400))
    return whole[:start] + rng.bytes(length) + whole[start + length :]


def lost(rng, whole):
    start = int(rng.integers(len(whole)))
    return whole[:start] + whole[start + int(rng.integers(1, 400)) :]


def grown(rng, whole):
    return (whole + rng.bytes(int(rng.integers(1, 400))), whole + whole, rng.bytes(7) + whole, b"PK\x03\x04" + whole)[
        int(rng.integers(4))
    ]


def foreign(rng, whole):
    other = BytesIO()
    np.savez(other, x=np.zeros(3))
    return (
        b"",
        b"PK\x03\x04",
        b"PK\x05\x06" + bytes(18),
        rng.bytes(500),
        b"\x80\x04N.",
        other.getvalue(),
        b"{}",
        b"\x93NUMPY\x01\x00",
    )[int(rng.integers(8))]


def places(whole, mark):
    found, k = [], whole.find(mark)
    while k >= 0:
        found.append(k)
        k = whole.find(mark, k + 1)
    return found


# ---- members -------------------------------------------------------------------------------------------------------------


def members(whole):
    with zipfile.ZipFile(BytesIO(whole)) as archive:
        return {info.filename: archive.read(info) for info in archive.infolist()}


def packed(pairs, method=zipfile.ZIP_DEFLATED):
    made = BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(made, "w", method) as archive:
        warnings.simplefilter("ignore")  # of two members with one name
        for name, content in pairs:
            archive.writestr(name, content)
    return made.getvalue()


def npy(array):
    made = BytesIO()
    np.lib.format.write_array(made, np.asanyarray(array), allow_pickle=True)
    return made.getvalue()


def drawn(rng, held):
    names = [name for name in held if name != HEADER]
    return names[int(rng.integers(len(names)))] if names else HEADER


def swapped(rng, whole):
    held = members(whole)
    one, other = drawn(rng, held), drawn(rng, held)
    held[one], held[other] = held[other], held[one]
    return packed(held.items())


def renamed(rng, whole):
    held = members(whole)
    name = drawn(rng, held)
    return packed([(name + "x" if key == name else key, value) for key, value in held.items()])


def twice(rng, whole):
    held = members(whole)
    name = drawn(rng, held)
    return packed([*held.items(), (name, held[name] if rng.random() < 0.5 else npy(np.zeros(3)))])


def other_array(rng, whole):
    """Another type, shape, order of bytes or content, which the header does not know."""
    held = members(whole)
    name = drawn(rng, held)
    array = np.load(BytesIO(held[name]), allow_pickle=False)
    changes = [
        lambda: array.astype(array.dtype.newbyteorder(">")),
        lambda: array.astype(np.float32) if array.dtype.kind in "biuf" else array[..., None],
        lambda: array[None],
        lambda: array.reshape(-1)[:-1],
        lambda: np.array([{"a": 1}], dtype=object),
        lambda: np.asfortranarray(array.T),
        lambda: np.zeros(array.shape),
        lambda: np.full(array.shape, np.nan),
    ]
    held[name] = npy(changes[int(rng.integers(len(changes)))]())
    return packed(held.items())


def other_start(rng, whole):
    """An array that says of itself what is not so."""
    held = members(whole)
    name = drawn(rng, held)
    huge = int(10 ** rng.uniform(3, 19))
    words = (
        f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({huge},), }}",
        "{'descr': " + "[" * 90 + "]" * 90 + "}",
        "-" * 4000 + "1",
        "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }",
        "x" * 20000,
        "{'descr': '<f8'}",
    )
    text = (words[int(rng.integers(len(words)))] + "\n").encode()
    held[name] = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + held[name][128:]
    return packed(held.items())


def bombs(rng, whole):
    """Zeros under another name, in the place of an array, of the header; an archive in an archive; a way of packing never used."""
    held, zeros = members(whole), bytes(int(10 ** rng.uniform(6, 8)))
    return (
        lambda: packed([*held.items(), ("bomb.npy", zeros)]),
        lambda: packed({**held, drawn(rng, held): zeros}.items()),
        lambda: packed({**held, HEADER: npy(np.zeros(len(zeros), np.uint8))}.items()),
        lambda: packed({**held, HEADER: b"\x93NUMPY\x01\x00" + zeros}.items()),
        lambda: packed([("inner.npz", whole)]),
        lambda: packed({**held, drawn(rng, held): whole}.items()),
        lambda: packed(held.items(), zipfile.ZIP_LZMA),
        lambda: packed([*held.items(), *((f"m{k}.npy", b"") for k in range(5000))]),
    )[int(rng.integers(8))]()


def sized(rng, whole):
    """Sizes and sums in the list of members."""
    changed, marks = bytearray(whole), places(whole, b"PK\x01\x02")
    k = marks[int(rng.integers(len(marks)))]
    place = k + int(rng.choice([8, 10, 16, 20, 24, 42]))
    changed[place : place + 4] = int(rng.choice([0, 1, 2**31, 2**32 - 1, int(rng.integers(2**32))])).to_bytes(4, "little")
    return bytes(changed)


def other_header(rng, whole):
    """A header that is no JSON, not this format, or says of the arrays what is not so."""
    held = members(whole)
    text = held[HEADER][128:].decode()
    text = text[text.index("{") :] if "{" in text else "{}"
    record = json.loads(np.load(BytesIO(held[HEADER])).tobytes())
    name = next(iter(record["arrays"]), "x")
    deep = 10 ** int(rng.integers(3, 6))

    def told(value):
        return json.dumps({**record, "arrays": {**record["arrays"], name: value}}).encode()

    huge = int(10 ** rng.uniform(3, 20))
    made = (
        lambda: b"\xff\xfe" + text.encode(),
        lambda: b"[" * deep + b"]" * deep,
        lambda: b'{"a":' * deep + b"1" + b"}" * deep,
        lambda: b"[]" + b",[]" * 1_000_000,
        lambda: json.dumps({**record, "x": math.nan}).encode(),
        lambda: json.dumps(record).encode()[:-1] + b', "kind": "orbit"}',
        lambda: json.dumps(record).encode()[:-1] + b', "x": 1e999}',
        lambda: json.dumps(record).encode()[:-1] + b', "x": ' + b"1" * 5000 + b"}",
        lambda: json.dumps({**record, "version": 10**9}).encode(),
        lambda: json.dumps({**record, "version": "1"}).encode(),
        lambda: json.dumps({**record, "format": "x"}).encode(),
        lambda: json.dumps({k: v for k, v in record.items() if k != "kind"}).encode(),
        lambda: json.dumps({**record, "kind": {}}).encode(),
        lambda: json.dumps({**record, "kind": "recipe"}).encode(),
        lambda: json.dumps({k: v for k, v in record.items() if k != "arrays"}).encode(),
        lambda: json.dumps({**record, "arrays": 3}).encode(),
        lambda: told(["<f8", [huge], 0]),
        lambda: told(["<f8", [huge, huge], 0]),
        lambda: told(["f8," * 100000, [1], 0]),
        lambda: told([f"<U{huge}", [1], 0]),
        lambda: told(["|O", [1], 0]),
        lambda: told(None),
        lambda: told([1, 2]),
        lambda: told({}),
        lambda: told(["<f8", "3", 0]),
        lambda: told(["<f8", [3.0], 0]),
        lambda: told(["<f8", [1] * 70, 0]),
        lambda: b"",
        lambda: b"null",
    )
    held[HEADER] = npy(np.frombuffer(made[int(rng.integers(len(made)))](), np.uint8))
    return packed(held.items())


UNKNOWN = (
    cut,
    flipped,
    flipped_in_lists,
    overwritten,
    lost,
    grown,
    foreign,
    swapped,
    renamed,
    twice,
    other_array,
    other_start,
    bombs,
    sized,
    other_header,
)


# ---- records that vouch for themselves ------------------------------------------------------------------------------------


def branches(value, place=()):
    """Yield every place of a header."""
    if place:
        yield place
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from branches(inner, (*place, key))


def header_changed(rng, header, arrays):
    """One value of the header is missing, or another."""
    changed = json.loads(json.dumps(header))
    every = [place for place in branches(changed) if place[0] not in ("format", "version", "kind")]
    *way, last = every[int(rng.integers(len(every)))]
    inner = changed
    for key in way:
        inner = inner[key]
    others = (
        None,
        "x",
        "",
        -1,
        0,
        1,
        0.5,
        1e308,
        -1e308,
        10**12,
        10**30,
        [],
        {},
        True,
        [[]],
        "x" * 10**5,
        ["x"],
        {"x": 1},
        [1.0, 2.0],
    )
    if rng.random() < 0.2:
        del inner[last]
    else:
        inner[last] = others[int(rng.integers(len(others)))]
    return changed, arrays


def array_changed(rng, header, arrays):
    """One array has other values, type or shape."""
    if not arrays:
        return header_changed(rng, header, arrays)
    name = list(arrays)[int(rng.integers(len(arrays)))]
    values = arrays[name]
    number = values.dtype.kind in "biufc"
    changes = (
        lambda: values[..., None],
        lambda: values.reshape(-1),
        lambda: values.reshape(-1)[:-1],
        lambda: np.zeros(0),
        lambda: np.zeros((0,) * values.ndim, values.dtype),
        lambda: values.astype(str),
        lambda: np.repeat(values.reshape(-1), 3),
        lambda: values * 0 if number else values[:0],
        lambda: values - 10**6 if values.dtype.kind in "if" else values,
        lambda: values * 10.0**200 if values.dtype.kind == "f" else values,
        lambda: values.astype(values.dtype.newbyteorder(">")),
        lambda: np.full(values.shape, 2**62) if values.dtype.kind == "i" else values,
        lambda: np.zeros((3, 3)),
        lambda: rng.permutation(values.reshape(-1)).reshape(values.shape),
        lambda: np.array("x"),
    )
    return header, {**arrays, name: changes[int(rng.integers(len(changes)))]()}


VOUCHED = (header_changed, array_changed)


# ---- verdicts --------------------------------------------------------------------------------------------------------------


class Made:
    """Results of the kinds, saved and read once."""

    def __init__(self, folder, kinds=tuple(KINDS)):
        self.folder, self.good = Path(folder), {}
        for kind in kinds:
            path = self.folder / f"{kind}.npz"
            KINDS[kind]().save(path)
            self.good[kind] = (path.read_bytes(), *io.read(path), bf.load(path))

    def verdict(self, seed, kind, change):
        """Return (word, what was said) of one damaged file."""
        whole, header, arrays, found = self.good[kind]
        rng, path = np.random.default_rng([seed, zlib.crc32(f"{kind} {change.__name__}".encode())]), self.folder / "broken.npz"
        if change in VOUCHED:
            path.unlink(missing_ok=True)
            io.write(path, *change(rng, header, arrays))
        else:
            path.write_bytes(change(rng, whole))
        refused = loaded = None
        tracemalloc.start()
        clock = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                loaded = bf.load(path)
        except Exception as error:
            refused = error
        seconds, memory = time.process_time() - clock, tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        said = f"{type(refused).__name__}: {refused}"
        if seconds > SECONDS or memory > MEMORY:
            return "slow", f"{seconds:.1f} s, {memory / 1e6:.0f} MB: {said}"
        if refused is not None:
            clean = isinstance(refused, io.FileFormatError) and str(path) in str(refused) and "\n" not in str(refused)
            return ("refused" if clean and "allow_pickle" not in said and len(said) < 1000 else "unclean"), said
        if change in VOUCHED:
            return "read", ""
        return ("equal" if repr(loaded) == repr(found) and same(io.read(path), (header, arrays)) else "other content"), ""


def same(one, other):
    return (
        json.dumps(one[0]) == json.dumps(other[0])
        and list(one[1]) == list(other[1])
        and all(np.array_equal(one[1][name], other[1][name], equal_nan=one[1][name].dtype.kind in "fc") for name in one[1])
    )


BAD = ("slow", "unclean", "other content")


def study(count, folder, seed=0, kinds=tuple(KINDS)):
    """Return the verdicts of so many files: a list of (kind, change, word, what was said)."""
    made, changes = Made(folder, kinds), (*UNKNOWN, *VOUCHED, *VOUCHED)
    rows = []
    for k in range(count):
        kind, change = kinds[k % len(kinds)], changes[(k // len(kinds) + k) % len(changes)]
        rows.append((kind, change.__name__, *made.verdict(seed + k, kind, change)))
    return rows


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        found = study(int(sys.argv[1]), place, int(sys.argv[2]) if sys.argv[2:] else 0)
    table = Counter((change, word) for _, change, word, _ in found)
    for (change, word), number in sorted(table.items()):
        print(f"{change:20s} {word:15s} {number}")
    print(Counter(word for _, _, word, _ in found))
    for row in found:
        if row[2] in BAD:
            print(*row[:3], row[3][:300])
