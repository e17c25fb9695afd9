"""The command line."""

from __future__ import annotations

import click

from movimentum import __version__


@click.group()
@click.version_option(__version__, prog_name="movimentum")
def main() -> None:
    """Animate mechanisms by stating what is connected to what."""
