"""Configurations of machines by name or in files, and the option of all commands that takes them.

A file is JSON::

    {
     "bkdtree configuration": 1,
     "about": {"scene": "elephant.npz", "command": "..."},
     "config": {"fmt": "7,16", "packets": 16, "update": false}
    }

`about` says what it was fitted to, for people. Parameters that are not in `config` are those of the
full machine.
"""

import json
from argparse import Namespace
from dataclasses import fields
from pathlib import Path

from hdl.config import CONFIGS, Config
from hdl.fp.format import FloatFormat
from sim.command import Parser, format_bits
from sim.errors import InputError, UnfitError
from sim.files import write_json

KIND, VERSION = "bkdtree configuration", 1
KINDS = {bool: "true or false", int: "a whole number", FloatFormat: 'a text such as "7,16"'}
"""What is allowed for a parameter, by its type."""


def config_argument(parser: Parser, default: str | None = "full"):
    """The configuration of a machine."""
    text = f"{', '.join(CONFIGS)}, or a file with one; {default or 'full'}"
    parser.add_argument("-c", "--config", metavar="CONFIG", default=default, help=text)


def config_name(text: str) -> str:
    """What to call the configuration of an option: its name, or that of its file."""
    return text if text in CONFIGS else Path(text).stem


def read_config(text: str) -> Config:
    """The configuration of a name, or in a file.

    Raises
    ------
    InputError
        There is none: names the file, what in it is wrong, and what is allowed.
    """
    if text in CONFIGS:
        return CONFIGS[text]
    file = Path(text)
    try:
        return _config_in(json.loads(file.read_text()))
    except FileNotFoundError:
        names = ", ".join(CONFIGS)
        raise InputError(f"{text}: no such configuration; give {names}, or a file") from None
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}") from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{file}: is no JSON: {error}") from error
    except ValueError as error:
        raise InputError(f"{file}: {error}") from error


def write_config(file: Path, config: Config, about: dict):
    """Write a configuration with all its parameters, whole or not at all."""
    values = {field.name: getattr(config, field.name) for field in fields(Config)}
    write_json(file, {KIND: VERSION, "about": about, "config": values | {"fmt": str(config.fmt)}})


def explain(options: Namespace, error: Exception) -> str:
    """What a machine of a file was fitted to, where it is not one for what it is to do now."""
    text = getattr(options, "config", None)
    if not isinstance(error, UnfitError) or not text or text in CONFIGS:
        return ""
    match json.loads(Path(text).read_text()).get("about"):
        case {"scene": str(scene), "size": [int(width), int(height)]}:
            return f" ({text} was fitted to {scene}, with --divide, at {width}x{height})"
    return f" ({text})"


def _config_in(content: object) -> Config:
    """The configuration that the content of a file says; else a ValueError that says why."""
    if not isinstance(content, dict) or KIND not in content:
        raise ValueError(f'is no configuration: it has no "{KIND}": {VERSION}')
    if content[KIND] != VERSION:
        raise ValueError(f'"{KIND}" is {_shown(content[KIND])}, and this release reads {VERSION}')
    parts = {"about": {}, "config": {}}
    _check_keys("the file", content, [KIND, *parts])
    parts |= {name: content[name] for name in parts if name in content}
    for name, part in parts.items():
        if not isinstance(part, dict):
            raise ValueError(f'"{name}" is an object in braces, not {_shown(part)}')
    types = {field.name: field.type for field in fields(Config)}
    _check_keys('"config"', parts["config"], list(types))
    values = {}
    for name, value in parts["config"].items():
        kind = types[name]
        allowed = str if kind is FloatFormat else kind
        if type(value) is not allowed:
            raise ValueError(f'"{name}" is {KINDS[kind]}, not {_shown(value)}')
        values[name] = _format(value) if kind is FloatFormat else value
    return Config(**values)


def _check_keys(where: str, found: dict, known: list[str]):
    unknown = [key for key in found if key not in known]
    if unknown:
        raise ValueError(f'{where} has "{unknown[0]}", which is none of {", ".join(known)}')


def _format(text: str) -> FloatFormat:
    bits = format_bits(text)
    if not bits:
        raise ValueError(f'"fmt" is {KINDS[FloatFormat]}, not {_shown(text)}')
    try:
        return FloatFormat(*bits)
    except ValueError as error:
        raise ValueError(f'"fmt": {error}') from error


def _shown(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) < 40 else f"{text[:36]} ..."
