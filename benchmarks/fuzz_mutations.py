"""Changes of bytes, of lines of text and of JSON, drawn from a generator."""

import json

INTERESTING = [0, 1, 2, 7, 8, 15, 16, 31, 32, 63, 64, 65, 127, 128, 255, 256, 1023, 4096, 0x7FFF, 0x8000, 0xFFFF]
INTERESTING += [0x10000, 1 << 20, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1, 1 << 63, (1 << 64) - 1]
NASTY = [
    "", "0", "-1", "1", "255", "256", "99999", "4294967296", "1e999", "-1e308", "nan", "inf", "-inf", "0x7f", "1,5",
    "9" * 400, "x" * 5000, " " * 70_000, "\t", "\x00", "\x1b[2J", "\ufeff", "ü", "🙂", "null", "true", "[]", "{}", "~",
    "[" * 500, "{a: " * 50, "&a [*a]", "!!python/name:os.system", "..", "../../etc/passwd", "/dev/zero", "%s%n", "'",
    '"', "1 furlong", "1e400 A", "-5 deg", "1 2 3", ";", ":", "#", "//", "\r", "\v", "\u2028",
]  # fmt: skip
ODD = [
    None,
    True,
    False,
    0,
    -1,
    1,
    10**30,
    -(10**30),
    1e308,
    float("nan"),
    float("inf"),
    "",
    "x" * 5000,
    "../x",
    [],
    {},
]
ODD += [[[]], {"a": {}}, ["x"] * 1000, "\x00", "2026-01-01T00:00:00", 3.5]


def changed_bytes(rng, data):
    """A few places of a file overwritten, cut, doubled or moved."""
    data = bytearray(data)
    for _ in range(rng.choice([1, 1, 1, 2, 4, 16])):
        if not data:
            data += bytes([rng.randrange(256)])
        at = rng.randrange(len(data))
        end = min(len(data), at + rng.choice([1, 2, 4, 8, 32, 512]))
        kind = rng.randrange(7)
        if kind == 0:
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            data[at] = rng.randrange(256)
        elif kind == 2:
            size = rng.choice([1, 2, 4, 8])
            value = rng.choice(INTERESTING) % (1 << 8 * size)
            data[at : at + size] = value.to_bytes(size, rng.choice(["little", "big"]))
        elif kind == 3:
            del data[at:end]
        elif kind == 4:
            data[at:at] = data[at:end] * rng.choice([1, 1, 2, 50])
        elif kind == 5:
            data[at:at] = bytes(rng.randrange(256) for _ in range(rng.choice([1, 4, 64])))
        elif rng.random() < 0.3:
            del data[at:]
    return bytes(data)


def changed_lines(rng, text):
    """A few lines of a text dropped, doubled, moved, or with words that are replaced."""
    lines = text.split("\n")
    for _ in range(rng.choice([1, 1, 2, 4, 20])):
        at = rng.randrange(len(lines))
        kind = rng.randrange(9)
        if kind == 0 and len(lines) > 1:
            del lines[at]
        elif kind == 1:
            lines[at:at] = [lines[at]] * rng.choice([1, 1, 2, 300])
        elif kind == 2:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
        elif kind == 3:
            lines[at] = lines[at][: rng.randrange(len(lines[at]) + 1)]
        elif kind == 4:
            lines[at] = rng.choice([" ", "  ", "\t"]) + lines[at]
        elif kind == 5 and lines[at]:
            place = rng.randrange(len(lines[at]))
            lines[at] = (
                lines[at][:place] + chr(rng.choice([*range(32, 127), 0, 9, 13, 228, 8232])) + lines[at][place + 1 :]
            )
        elif kind == 6:
            lines[at] = rng.choice(NASTY)
        else:
            words = lines[at].split(" ")
            words[rng.randrange(len(words))] = rng.choice(NASTY)
            lines[at] = " ".join(words)
    return "\n".join(lines)


def changed_json(rng, value):
    """One place of a JSON value replaced, dropped, doubled or renamed."""
    if not isinstance(value, dict | list) or not value or rng.random() < 0.1:
        return rng.choice(ODD)
    at, kind = rng.randrange(len(value)), rng.randrange(8)
    if isinstance(value, list):
        parts = [[], [value[at]] * 3, *[[changed_json(rng, value[at])]] * 6]
        return [*value[:at], *parts[kind], *value[at + 1 :]]
    entries = list(value.items())
    key, content = entries[at]
    parts = [[], [(rng.choice(["", "x", key.upper()]), content)], *[[(key, changed_json(rng, content))]] * 6]
    return dict([*entries[:at], *parts[kind], *entries[at + 1 :]])


def changed_json_text(rng, text):
    """A JSON file with a value changed, or its text."""
    if rng.random() < 0.2:
        return changed_lines(rng, text)
    return json.dumps(changed_json(rng, json.loads(text)), indent=1)


def changed_json_lines(rng, text):
    """A file of JSON values, a line each, with one changed, or its lines."""
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    if rng.random() < 0.3 or not lines[at]:
        return changed_lines(rng, text)
    lines[at] = json.dumps(changed_json(rng, json.loads(lines[at])))
    return "\n".join(lines)
