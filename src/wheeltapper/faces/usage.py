"""Messages for a wrong command line, in one line as for all other input."""

from __future__ import annotations

from typing import Any, Literal, get_args, get_origin

from cyclopts import CycloptsError
from cyclopts.exceptions import (
    CoercionError,
    MissingArgumentError,
    UnknownCommandError,
    UnknownOptionError,
    UnusedCliTokensError,
)

from wheeltapper.ground.errors import InputError, with_suggestion


def as_input_error(error: CycloptsError) -> InputError:
    """Return the error of a command line in the form of this package."""
    command = " ".join(error.command_chain or ())
    match error:
        case UnknownCommandError():
            name, names = (error.unused_tokens or [""])[0], _command_names(error.app)
            return InputError("", "command", repr(name), with_suggestion(name, error.app or (), ", ".join(names)))
        case UnknownOptionError():
            name = (error.token.keyword or error.token.value).partition("=")[0]
            names = _option_names(error.argument_collection)
            return InputError(command, name, "an option that is unknown", with_suggestion(name, names))
        case MissingArgumentError() if error.argument is not None:
            return InputError(
                command, _argument_name(error.argument), "nothing", _argument_meaning(error.app, error.argument)
            )
        case CoercionError() if error.argument is not None and error.token is not None:
            allowed, choices = _allowed_values(error.target_type or error.argument.hint)
            found = error.token.value
            return InputError(
                command, _argument_name(error.argument), repr(found), with_suggestion(found, choices, allowed)
            )
        case UnusedCliTokensError():
            left = ", ".join(repr(token) for token in error.unused_tokens or ())
            return InputError(command, "", f"{left} left over", f"what `wheeltapper {command} --help` lists")
        case _:
            return InputError(command, "", " ".join(str(error).split()), "")


def _command_names(app: Any) -> list[str]:
    return [name for name in app if not name.startswith("-")]


def _option_names(arguments: Any) -> list[str]:
    return sorted(name for argument in arguments for name in argument.names if name.startswith("--"))


def _argument_name(argument: Any) -> str:
    """Return an option with its dashes, and an argument as the help writes it."""
    return str(argument.name.lstrip("-").upper() if argument.field_info.is_positional else argument.name)


def _argument_meaning(app: Any, argument: Any) -> str:
    """Return the description of an argument in the command's docstring."""
    described = app.assemble_argument_collection(parse_docstring=True) if app is not None else ()
    said = next((str(other.parameter.help) for other in described if other.names == argument.names), "")
    return said[:1].lower() + said[1:].rstrip(".") if said else "a value"


def refuse_fractions(app: Any, commands: Any, arguments: Any) -> None:
    """Refuse fractional values of whole numbers, which cyclopts would round."""
    for argument in arguments:
        if int in (argument.hint, *get_args(argument.hint)):
            for token in argument.tokens:
                if not token.value.lstrip("+-").isdecimal():
                    raise CoercionError(argument=argument, token=token, target_type=int)


def _allowed_values(hint: Any) -> tuple[str, list[str]]:
    """Return the allowed values of a type, with the choices if they are words."""
    if get_origin(hint) is Literal:
        choices = [str(choice) for choice in get_args(hint)]
        return ", ".join(choices), choices
    return {int: "a whole number", float: "a number", bool: "yes or no"}.get(hint, "a value of that kind"), []
