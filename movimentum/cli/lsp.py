"""`movimentum lsp`: the language server."""

from __future__ import annotations

from importlib.util import find_spec

import click

from movimentum.cli.common import EXIT_CODES, SPEECH
from movimentum.errors import usage_error


@click.command(
    epilog="""\b
Examples:
  movimentum lsp

"""
    + EXIT_CODES
)
@click.option("--stdio", is_flag=True, help="Serve over standard input and output; it always does.")
@SPEECH
def lsp(*, stdio: bool) -> int:
    """Serve editors over standard input and output: the language server (extra `lsp`).

    It reports errors while you type, completes, explains, renames and formats. Your editor starts it.
    """
    del stdio  # editors give it, as other servers need it
    if find_spec("pygls") is None:
        message = "the language server needs pygls, which is not installed"
        raise usage_error("usage/extra", message, "pip install 'movimentum[lsp]'")
    from movimentum.lsp.server import serve

    serve()
    return 0
