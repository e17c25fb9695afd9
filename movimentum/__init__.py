"""Movimentum: animate mechanisms by stating what is connected to what."""

__version__ = "0.1.0"
