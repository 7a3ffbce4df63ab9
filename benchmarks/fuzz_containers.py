"""Valid containers with wrong contents: BLF objects, MF4 blocks, SQLite rows, gzip, MAT and Parquet."""

import gzip
import io
import sqlite3
import struct
import zlib

import numpy as np
import pyarrow as pa
import scipy.io
from fuzz_mutations import INTERESTING, changed_bytes
from pyarrow import parquet

COLUMNS = (
    "ts REAL",
    "arbitration_id INTEGER",
    "extended INTEGER",
    "remote INTEGER",
    "error INTEGER",
    "dlc INTEGER",
    "data BLOB",
)
BLF_HEADER, MF4_HEADER, MAT_HEADER = 144, 64, 128


def number(rng, size):
    """An interesting number of so many bytes."""
    return (rng.choice(INTERESTING) + rng.choice([0, 0, 0, -1, 1])) % (1 << 8 * size)


def changed_blf(rng, data):
    """Objects with wrong fields in containers that are right, or containers that say wrong things of what they hold."""
    if rng.random() < 0.15:
        return changed_bytes(rng, data)
    out, at = bytearray(data[:BLF_HEADER]), BLF_HEADER
    while at + 32 <= len(data):
        old = struct.unpack_from("<I", data, at + 8)[0]
        body = zlib.decompress(data[at + 32 : at + old])
        method, claimed = 2, None
        if rng.random() < 0.4:
            body = _changed_objects(rng, body)
        if rng.random() < 0.05:
            body = body[: rng.randrange(len(body) + 1)]
        if rng.random() < 0.02:
            body += bytes(rng.choice([1, 1000, 40 << 20]))
        packed = zlib.compress(body, rng.choice([0, 1, 9]))
        if rng.random() < 0.1:
            method, packed = 0, body
        if rng.random() < 0.05:
            packed = changed_bytes(rng, packed)
        if rng.random() < 0.05:
            claimed, method = number(rng, 4), rng.choice([0, 1, 2, 2, 3])
        size = 32 + len(packed) if rng.random() < 0.97 else number(rng, 4)
        kind = 10 if rng.random() < 0.98 else rng.choice([1, 86, 100, 0, 115])
        out += struct.pack("<4sHHII", b"LOBJ", 16, 1, size, kind) + struct.pack(
            "<H6xI4x", method, len(body) if claimed is None else claimed
        )
        out += packed + bytes(len(packed) % 4)
        at += old + old % 4
    return bytes(out)


def _changed_objects(rng, body):
    body = bytearray(body)
    starts = [at for at in range(0, len(body) - 32, 4) if body[at : at + 4] == b"LOBJ"]
    for _ in range(rng.choice([1, 1, 3, 50])):
        at = rng.choice(starts)
        # Header size, version, size, type, flags, stamp; channel, flags, length and identifier; the payload.
        place, size = rng.choice(
            [(4, 2), (6, 2), (8, 4), (12, 4), (16, 4), (24, 8), (32, 2), (34, 1), (35, 1), (36, 4), (40, 8), (0, 4)]
        )
        value = (
            rng.choice([1, 2, 73, 86, 100, 101, 104, 115]) if place == 12 and rng.random() < 0.8 else number(rng, size)
        )
        if at + place + size <= len(body):
            body[at + place : at + place + size] = value.to_bytes(size, "little")
    return bytes(body)


def changed_mf4(rng, data):
    """Links, lengths, counts and places of channels that are wrong, and packed blocks with wrong contents."""
    if rng.random() < 0.15:
        return changed_bytes(rng, data)
    data = bytearray(data)
    blocks = [at for at in range(MF4_HEADER, len(data) - 24, 8) if data[at : at + 2] == b"##"]
    for _ in range(rng.choice([1, 1, 2, 5])):
        at = rng.choice(blocks)
        count = min(struct.unpack_from("<Q", data, at + 16)[0], (len(data) - at - 24) // 8)
        kind, first = rng.randrange(5), at + 24 + 8 * count
        if kind == 0 and count:
            target = rng.choice([*blocks, 0, at, len(data), number(rng, 8)])
            struct.pack_into("<Q", data, at + 24 + 8 * rng.randrange(count), target)
        elif kind == 1:
            struct.pack_into("<Q", data, at + rng.choice([8, 16]), number(rng, 8))
        elif kind == 2 and data[at : at + 4] == b"##DZ":
            _changed_packed(rng, data, first)
        elif kind == 3 and bytes(data[at : at + 4]) in {b"##CN", b"##CG", b"##SI"}:
            size = rng.choice([1, 1, 2, 4])
            place = first + rng.randrange(0, 40)
            if place + size <= len(data):
                data[place : place + size] = number(rng, size).to_bytes(size, "little")
        elif kind == 4:
            data[at : at + 4] = rng.choice([b"##DT", b"##DL", b"##HL", b"##DZ", b"##CN", b"##xx"])
    return bytes(data)


def _changed_packed(rng, data, first):
    """Change a packed block in place: as the links stand, it may only become shorter."""
    if first + 24 > len(data):
        return  # another change gave the block more links than there are
    packed = struct.unpack_from("<Q", data, first + 16)[0]
    if rng.random() < 0.3:
        struct.pack_into("<BxIQ", data, first + 2, rng.choice([0, 0, 1, 2]), number(rng, 4), number(rng, 8))
        return
    try:
        body = bytearray(zlib.decompress(bytes(data[first + 24 : first + 24 + packed])))
    except zlib.error:
        return  # another change met it before
    for _ in range(rng.choice([1, 10, 300])):
        at = rng.randrange(len(body) // 8) * 8
        body[at : at + 8] = rng.choice(
            [
                struct.pack("<d", rng.choice([0.0, -1.0, 1e300, float("nan"), 5.0, 1e9])),
                number(rng, 8).to_bytes(8, "little"),
            ]
        )
    new = zlib.compress(bytes(body), 9)
    if len(new) <= packed:
        data[first + 24 : first + 24 + len(new)] = new
        struct.pack_into("<Q", data, first + 16, len(new))


def changed_gzip(rng, data):
    """Packed again, whole, cut, in several members, with a bomb behind, or with a wrong byte."""
    kind = rng.randrange(6)
    if kind == 0:
        return changed_bytes(rng, gzip.compress(data, 1))
    if kind == 1:
        packed = gzip.compress(data, 1)
        return packed[: rng.randrange(len(packed))]
    if kind == 2:
        cut = rng.randrange(len(data) + 1)
        return gzip.compress(data[:cut], 1) + bytes(rng.choice([0, 7])) + gzip.compress(data[cut:], 1)
    if kind == 3:
        return gzip.compress(data + rng.choice([b"\n", b"0", b"\0", b" "]) * rng.choice([1000, 1 << 20, 100 << 20]), 1)
    return gzip.compress(changed_bytes(rng, data), 1) if kind == 4 else data


def odd_value(rng):
    return rng.choice(
        [
            None,
            0,
            -1,
            1,
            3,
            64,
            2**31,
            2**63 - 1,
            -(2**63),
            0.5,
            1e300,
            float("inf"),
            "",
            "x",
            "12",
            b"",
            b"\0",
            bytes(8),
            bytes(65),
            bytes(5000),
        ]
    )


def changed_sqlite(rng, path, data):
    """Rows with values of other kinds, tables of another shape, views and functions, or wrong pages."""
    path.write_bytes(data)
    kind = rng.randrange(5)
    if kind == 0:
        path.write_bytes(changed_bytes(rng, data))
        return
    with sqlite3.connect(path) as database:
        if kind in {1, 2}:
            for _ in range(rng.choice([1, 2, 20])):
                column = rng.choice(COLUMNS).split()[0]
                database.execute(
                    f"UPDATE messages SET {column} = ? WHERE rowid = ?",  # noqa: S608 (of ours)
                    (odd_value(rng), rng.randrange(1, 200)),
                )
        elif kind == 3:
            database.execute("ALTER TABLE messages RENAME TO old")
            columns = rng.sample(COLUMNS, rng.choice([5, 6, 7, 7, 7]))
            extra = rng.choice([[], ["more"], ["more AS (zeroblob(900000000))"]])
            database.execute(f"CREATE TABLE messages ({', '.join([*columns, *extra])})")
            names = ", ".join(column.split()[0] for column in columns)
            database.execute(f"INSERT INTO messages ({names}) SELECT {names} FROM old")  # noqa: S608
        else:
            database.execute("ALTER TABLE messages RENAME TO old")
            source = rng.choice(
                [
                    "WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n+1 FROM c) SELECT old.* FROM c, old",
                    "SELECT ts, arbitration_id, extended, remote, error, dlc, zeroblob(1000000000) AS data FROM old",
                    "SELECT * FROM messages",
                    "SELECT * FROM old",
                ]
            )
            database.execute(f"CREATE VIEW messages AS {source}")
    database.close()


def changed_mat(rng, names):
    """Numeric vectors of any shape and kind, packed or not, whose tags or contents are wrong."""
    content, count = {}, rng.choice([0, 1, 2, 100, 100, 100])
    for name in names:
        values = np.linspace(0, 1, count).astype(rng.choice(["f8", "f8", "f8", "f4", "i4", "u1", "c16"]))
        content[name] = rng.choice(
            [values] * 20
            + [values[None], values[:, None], {"a": values}, [values, "x"], "text", np.array([[values]], object)]
        )
    out = io.BytesIO()
    scipy.io.savemat(
        out,
        content,
        format=rng.choice(["5", "5", "5", "4"])
        if all(isinstance(v, np.ndarray) and v.dtype != object and v.ndim < 3 for v in content.values())
        else "5",
    )
    data = out.getvalue()
    if rng.random() < 0.2 or data[:4].count(0):
        return changed_bytes(rng, data)
    parts, at = [data[:MAT_HEADER]], MAT_HEADER
    while at + 8 <= len(data):
        size = struct.unpack_from("<I", data, at + 4)[0]
        element = bytearray(data[at : at + 8 + size])
        if rng.random() < 0.2:
            place = 4 * rng.randrange(min(len(element) // 4, 16))
            struct.pack_into("<I", element, place, number(rng, 4))
        if rng.random() < 0.05:
            element += bytes(rng.choice([8, 1 << 20, 300 << 20]))
        if rng.random() < 0.5:
            packed = zlib.compress(bytes(element), 1)
            element = struct.pack("<II", 15, len(packed) if rng.random() < 0.95 else number(rng, 4)) + packed
        parts.append(bytes(element))
        at += 8 + size
    return b"".join(parts)


def changed_parquet(rng, names):
    """Columns of any type and length, of any packing, whose bytes are wrong here and there."""
    count = rng.choice([0, 1, 100, 100, 100, 200_000])
    columns = {}
    for name in names:
        values = np.arange(count) * rng.choice([1.0, 1e-3, 0.0])
        few = min(count, 100)
        columns[name] = rng.choice(
            [
                *[pa.array(values)] * 4,
                pa.array(values.astype(rng.choice(["i8", "f4", "u1"]))),
                pa.array([None] * count, pa.float64()),
                pa.array(["x"] * few + [None] * (count - few)),
                pa.array([[1.0]] * few + [None] * (count - few)),
                pa.DictionaryArray.from_arrays(pa.array(np.zeros(count, np.int32)), pa.array([0.5])),
            ]
        )
    out = io.BytesIO()
    parquet.write_table(pa.table(columns), out, compression=rng.choice(["none", "snappy", "zstd", "gzip"]))
    data = out.getvalue()
    if rng.random() < 0.5:
        return data
    if rng.random() < 0.5:  # what says how the columns lie stands at the end
        length = struct.unpack_from("<I", data, len(data) - 8)[0]
        footer = changed_bytes(rng, data[-8 - length : -8])
        return data[: -8 - length] + footer + struct.pack("<I", len(footer)) + b"PAR1"
    return changed_bytes(rng, data)
