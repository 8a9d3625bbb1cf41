"""Inputs to fuzz with: texts and files that are nearly right, from a seed."""

from __future__ import annotations

import io
import json
import random
import zipfile
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

INTERESTING = (
    b"", b"0", b"-1", b"1e400", b"nan", b"inf", b"-0", b"9" * 20, b"9" * 5000, b"\0", b"\xff", b"\xef\xbb\xbf", b"\r",
    b"\n", b'"', b"'", b",", b"[", b"]", b"{", b"}", b"(", b")", b"\\", b"\xed\xa0\x80", "é".encode(), "◇".encode(),
    b"null", b"true", b"[" * 300, b"2147483647", b"18446744073709551616",
)  # fmt: skip
"""Bytes that readers stumble over."""


def mutated(rng: random.Random, content: bytes, other: bytes, words: Sequence[bytes] = INTERESTING) -> bytes:
    """The same content with a few places changed.

    Args:
        rng: Decides what and where.
        content: What is valid.
        other: Something else that is valid; slices of it are put in.
        words: What else is put in.
    """
    found = bytearray(content)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        at = rng.randrange(len(found) + 1)
        end = min(len(found), at + rng.choice((1, 1, 2, 4, 16, 200)))
        match rng.randrange(8):
            case 0:
                found[at:end] = b""
            case 1:
                found[at:end] = found[at:end] * 2
            case 2 if at < len(found):
                found[at] ^= 1 << rng.randrange(8)
            case 3 if at < len(found):
                found[at] = rng.randrange(256)
            case 4:
                found[at:end] = rng.choice(words)
            case 5:
                found[at:at] = rng.choice(words)
            case 6:
                start = rng.randrange(len(other) + 1)
                found[at:end] = other[start : start + rng.choice((1, 4, 30))]
            case _ if rng.random() < 0.2:
                del found[at:]
    return bytes(found)


# ---------------------------------------------------------------- formulas

_OPERATORS = ("F", "G", "eventually", "always", "◇", "□", "ev_", "alw_", r"\Diamond_", r"\Box_", "finally", "globally")
_SIGNS = ("<", "<=", ">", ">=", "==", "≤", "≥", "=", r"\leq", r"\gt")
_NAMES = ("x", "y", "x_{1}", '"a b"', r"\mathit{pos}", "F", "not", "x.y", "x[t]", '"\\""', "ξ", '""')
_NUMBERS = ("0", "3", "-1.5", "1e3", "1e400", ".5", "−2", "007", "1_0", "٣", "nan", "1e-400")
_TICKS = ("0", "1", "5", "15", "40", "-1", "1.5", "9" * 30, "9" * 5000, "+3", "²", "2147483648")
_TOKENS = (*_OPERATORS, *_SIGNS, *_NAMES, *_NUMBERS, *"()[]{},&|!~$#;", "&&", "||", "true", "false", "⊤", "\\", "\n")


def formula(rng: random.Random, depth: int = 4) -> str:
    """A formula by the grammar; now and then with a number or a name that is none."""
    odd = rng.random() < 0.1
    match rng.randrange(7) if depth else 6:
        case 0 | 1 | 2:
            low, high = sorted((rng.randrange(40), rng.randrange(40)))
            window = f"[{rng.choice(_TICKS)},{rng.choice(_TICKS)}]" if odd else f"[{low},{high}]"
            return f"{rng.choice(_OPERATORS)}{window} {formula(rng, depth - 1)}"
        case 3 | 4:
            sign = rng.choice((" & ", " | ", " and ", r" \vee ", "∧"))
            return "(" + sign.join(formula(rng, depth - 1) for _ in range(rng.randrange(2, 4))) + ")"
        case 5:
            return f"{rng.choice(('!', 'not ', '¬', '~'))}{formula(rng, depth - 1)}"
    name, number = (rng.choice(_NAMES), rng.choice(_NUMBERS)) if odd else (rng.choice("xyz"), str(rng.randrange(9)))
    signs = _SIGNS if odd else ("<", "<=", "≤")
    if rng.random() < 0.3:
        return f"({number} {rng.choice(signs)} {name} {rng.choice(signs)} {rng.randrange(9, 15)})"
    return f"({name} {rng.choice(signs)} {number})"


def formula_text(rng: random.Random) -> str:
    """A formula, or one that was mutated, or words of the language in any order."""
    if rng.random() < 0.2:
        return rng.choice(("", " ")).join(rng.choice(_TOKENS) for _ in range(rng.randrange(20)))
    if rng.random() < 0.02:  # deep or long
        return rng.choice(("(", "!", "F[0,1]", "(x>1)&", "G[0,1](")) * rng.randrange(500) + "x > 1"
    text = formula(rng)
    if rng.random() < 0.7:
        content = mutated(rng, text.encode(), formula(rng).encode(), [token.encode() for token in _TOKENS])
        text = content.decode(errors=rng.choice(("replace", "surrogateescape", "ignore")))
    return text


# ---------------------------------------------------------------- tables

_CELLS = (
    "", " ", "1", "-1", "0", "2", "nan", "inf", "1e400", "9" * 5000, "x", "1_0", "0x1", "٣", "\0", '"', "a\nb", "é",
)  # fmt: skip


def csv_text(rng: random.Random) -> bytes:
    """A long table with a few cells or columns that are wrong, or one that was mutated."""
    rows = [["trajectory", "tick", "x", "y", "label"]]
    for name in range(rng.randrange(4)):
        rows += [[f"t{name}", str(tick), str(rng.randrange(9)), "0.5", "1" if name % 2 else "-1"] for tick in range(3)]
    for _ in range(rng.choice((0, 1, 1, 2))):
        row = rng.choice(rows)
        match rng.randrange(4):
            case 0:
                row.append(rng.choice(_CELLS))
            case 1 if row:
                row.pop()
            case _ if row:
                row[rng.randrange(len(row))] = rng.choice(_CELLS)
    if rng.random() < 0.1:
        rng.shuffle(rows)
    sign = rng.choice((*"," * 30, ";", "\t"))
    content = rng.choice(("\n", "\r\n", "\r")).join(sign.join(row) for row in rows).encode()
    return mutated(rng, content, content) if rng.random() < 0.6 else content


_DTYPES = (
    "f8", "f4", "f2", "i8", "u1", "?", "c16", "U3", "S2", "M8[s]", "m8[s]", "O", "V4", ">f8", "g", "i4,f4", "u8", "U0",
)  # fmt: skip
_SHAPES = ((), (0,), (1,), (2,), (3,), (2, 3), (2, 3, 1), (2, 3, 2), (0, 3, 1), (2, 0, 1), (2, 3, 0), (2, 3, 1, 1))


def _array(rng: random.Random) -> NDArray[Any]:
    """Any array: any type, any shape, any numbers."""
    found = np.zeros(rng.choice(_SHAPES), dtype=rng.choice(_DTYPES))
    if found.size and rng.random() < 0.5 and found.dtype.kind in "biuf":
        with np.errstate(all="ignore"):
            found.flat[rng.randrange(found.size)] = rng.choice((1, 2, 9))
            if found.dtype.kind == "f":
                found.flat[rng.randrange(found.size)] = rng.choice((np.nan, np.inf, 1e300, -1e300, 0.5))
    return found


def npz_archive(rng: random.Random) -> bytes:
    """An archive with an array that is wrong or missing, or mutated inside, or mutated as a whole."""
    arrays: dict[str, NDArray[Any]] = {
        "X": np.zeros((2, 3, 1)), "y": np.array([1, -1]), "names": np.array(["x"]), "lengths": np.array([3, 2]),
        "ids": np.array(["a", "b"]),
    }  # fmt: skip
    for _ in range(rng.randrange(3)):
        name = rng.choice(sorted(arrays) or ["X"])
        if rng.random() < 0.3:
            arrays.pop(name, None)
        else:
            arrays[name] = _array(rng)
    inside = rng.random() < 0.4
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for name, array in arrays.items():
            entry = io.BytesIO()
            np.save(entry, array)
            content = entry.getvalue()
            if inside and rng.random() < 0.5:
                content = _mutated_npy(rng, content)
            archive.writestr(f"{name}.npy", content)
    content = buffer.getvalue()
    return mutated(rng, content, content) if rng.random() < 0.5 else content


_HEADER_WORDS = (
    b"(2,3,1)", b"(-1,)", b"(99999999999999999999,)", b"(4000000000000,)", b"'|O'", b"'<f8'", b"'<U9999999999'",
    b"True", b"(2**9,)", b"'<f99'", b"[('a','<f8')]", b"{}", b"\0", b"(" * 99, b"L", b"'fortran_order'", b"()",
)  # fmt: skip


def _mutated_npy(rng: random.Random, content: bytes) -> bytes:
    """An array's bytes, changed mostly in the header, which is where the type and the shape are."""
    header = content.index(b"\n") + 1 if b"\n" in content else len(content)
    changed = mutated(rng, content[:header], content[:header], (*INTERESTING, *_HEADER_WORDS))
    if rng.random() < 0.5:  # of the length that the file says
        changed = changed[: header - 1].ljust(header - 1) + b"\n"
    return changed + content[header : rng.choice((None, -1, header + 3))]


def parquet_file(rng: random.Random) -> bytes:
    """A Parquet file with columns of any type, or mutated."""
    import pyarrow
    import pyarrow.parquet

    count = rng.randrange(5)
    columns: dict[str, list[Any]] = {
        "trajectory": ["a"] * count, "tick": list(range(count)), "x": [0.5] * count, "label": [1] * count,
    }  # fmt: skip
    for _ in range(rng.randrange(3)):
        name = rng.choice(sorted(columns) or ["x"])
        value: Any = rng.choice(
            (None, 1, -1, 2.5, "x", b"\xff", True, [1], {"a": 1}, float("nan"), 10**18, "\0", 1e300)
        )
        if rng.random() < 0.3:
            columns.pop(name, None)
        else:
            columns[name] = [value] * count
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(
        pyarrow.table(columns), buffer, compression=rng.choice(("none", "snappy")), use_dictionary=rng.random() < 0.5
    )
    content = buffer.getvalue()
    return mutated(rng, content, content) if rng.random() < 0.6 else content


# ---------------------------------------------------------------- JSON

_VALUES: tuple[Callable[[], Any], ...] = (
    lambda: None, lambda: True, lambda: 0, lambda: -1, lambda: 1.5, lambda: 10**30, lambda: "", lambda: "x",
    lambda: "F[0,2] (x >= 3)", lambda: [], lambda: {}, lambda: [[]], lambda: "\ud800", lambda: np.nan, lambda: "a\nb",
    lambda: 2**31, lambda: "<", lambda: "long " * 400, lambda: False,
)  # fmt: skip


def json_text(rng: random.Random, valid: Sequence[str]) -> str:
    """A document with values or keys replaced, dropped, doubled or moved, or mutated as text."""
    text = rng.choice(valid)
    if rng.random() < 0.3:
        return mutated(rng, text.encode(), rng.choice(valid).encode()).decode(errors="surrogateescape")
    document = json.loads(text)
    for _ in range(rng.choice((1, 1, 2, 4))):
        _change(rng, document)
    return json.dumps(document, ensure_ascii=rng.random() < 0.5)


def _change(rng: random.Random, document: Any) -> None:
    """Change one place of a document, found by going down from the top."""
    place = document
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        if not keys:
            return
        key = rng.choice(keys)
        if isinstance(place[key], dict | list) and rng.random() < 0.8:
            place = place[key]
            continue
        break
    match rng.randrange(4):
        case 0:
            del place[key]
        case 1 if isinstance(place, list):
            place.insert(rng.randrange(len(place) + 1), place[key])
        case 2:
            place[key] = place[rng.choice(keys)]
        case _:
            place[key] = rng.choice(_VALUES)()
