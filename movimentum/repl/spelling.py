"""Formulas as the debugger writes them: in the words of the language."""

from movimentum.analysis.interactive.spelling import Unspoken as Unspoken
from movimentum.analysis.interactive.spelling import spelled as spelled
