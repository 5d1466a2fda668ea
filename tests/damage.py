"""Damage to files: single bits, values of another type, deep nesting."""

import base64
import json
import random
from typing import Any

ODD: tuple[Any, ...] = (None, True, -1, 10**40, 1e308, "", "\ud83c", "../../x", [], [None], {}, {"a": []}, "x" * 5000)


def mutated(value: Any, chance: random.Random) -> Any:
    """Return a JSON value with one of its members, at any depth, replaced, left out or renamed."""
    if isinstance(value, dict) and value and chance.random() < 0.9:
        name = chance.choice(list(value))
        match chance.randrange(6):
            case 0:
                return {key: item for key, item in value.items() if key != name}
            case 1:
                return {("id" if key == name else key): item for key, item in value.items()}
            case _:
                return value | {name: mutated(value[name], chance)}
    if isinstance(value, list) and value and chance.random() < 0.9:
        index = chance.randrange(len(value))
        return [*value[:index], mutated(value[index], chance), *value[index + 1 :]]
    return chance.choice(ODD)


def with_an_odd_value(content: bytes, chance: random.Random) -> bytes:
    """Change one JSON value of a file: of one of its lines, where it has several."""
    lines = content.splitlines(keepends=True)
    if not content.startswith(b"{"):
        return base64.encodebytes(json.dumps(mutated(json.loads(base64.b64decode(content)), chance)).encode())
    if lines[0].startswith(b'{"'):
        index = chance.randrange(len(lines))
        lines[index] = json.dumps(mutated(json.loads(lines[index]), chance)).encode() + b"\n"
        return b"".join(lines)
    return json.dumps(mutated(json.loads(content), chance)).encode()


def with_deep_nesting(content: bytes, chance: random.Random) -> bytes:
    """Put a list that is nested too deeply for any reader, or a number with as many digits, into a file."""
    depth = chance.choice((100, 900, 3000, 100_000))
    deep = b"[" * depth + b"]" * depth if chance.random() < 0.7 else b"9" * (depth * 2)
    lines = content.splitlines(keepends=True)
    if not content.startswith(b"{"):
        return base64.encodebytes(deep)
    if chance.random() < 0.5:
        return deep + b"\n"
    index = chance.randrange(len(lines)) if lines[0].startswith(b'{"') else 0
    lines[index] = lines[index].replace(b"{", b'{"deep":' + deep + b",", 1)
    return b"".join(lines)


def with_a_bit_flipped(content: bytes, chance: random.Random) -> bytes:
    index = chance.randrange(len(content))
    return content[:index] + bytes([content[index] ^ 1 << chance.randrange(8)]) + content[index + 1 :]
