"""`movimentum completion`: shell completion for commands, options and file names."""

from __future__ import annotations

import os

import click
from click.shell_completion import CompletionItem, ShellComplete, add_completion_class, get_completion_class

from movimentum.cli.common import EXIT_CODES, SPEECH
from movimentum.console import Console, answer

VARIABLE = "_MOVIMENTUM_COMPLETE"
"""The environment variable with which a shell asks."""

_POWERSHELL = """\
Register-ArgumentCompleter -Native -CommandName %(prog_name)s -ScriptBlock {
    param($word, $ast, $cursor)
    $line = $ast.ToString().PadRight($cursor - $ast.Extent.StartOffset).Substring(0, $cursor - $ast.Extent.StartOffset)
    $env:COMP_LINE = $line
    $env:COMP_WORD = $word
    $env:%(complete_var)s = 'powershell_complete'
    try { $found = @(& %(prog_name)s) } finally { Remove-Item Env:COMP_LINE, Env:COMP_WORD, Env:%(complete_var)s }
    $found | ForEach-Object {
        $type, $value, $help = $_ -split "`t", 3
        if ($type -eq 'plain') {
            [System.Management.Automation.CompletionResult]::new($value, $value, 'ParameterValue', $help)
        }
    }
}
"""


class PowerShell(ShellComplete):
    """Click knows bash, zsh and fish. Where nothing is proposed, PowerShell completes names of files by itself."""

    name = "powershell"
    source_template = _POWERSHELL

    def get_completion_args(self) -> tuple[list[str], str]:
        """The words before the one that is typed, and that one."""
        word = os.environ.get("COMP_WORD", "")
        words = os.environ.get("COMP_LINE", "").split()
        return (words[1:-1] if word else words[1:]), word

    def format_completion(self, item: CompletionItem) -> str:
        """Type, value and help, with tabs in between."""
        return f"{item.type}\t{item.value}\t{item.help or item.value}"


add_completion_class(PowerShell)


@click.command(
    epilog="""\b
Examples:
  eval "$(movimentum completion bash)"                                          in ~/.bashrc
  eval "$(movimentum completion zsh)"                                           in ~/.zshrc
  movimentum completion fish > ~/.config/fish/completions/movimentum.fish
  movimentum completion powershell | Out-String | Invoke-Expression             in $PROFILE

"""
    + EXIT_CODES,
)
@click.argument("shell", metavar="SHELL", type=click.Choice(["bash", "zsh", "fish", "powershell"]))
@SPEECH
@click.pass_context
def completion(context: click.Context, *, shell: str) -> int:
    """Print the completion script for SHELL: bash, zsh, fish or powershell."""
    kind = get_completion_class(shell)
    assert kind is not None, shell
    assert isinstance(context.obj, Console)
    answer(kind(context.find_root().command, {}, "movimentum", VARIABLE).source() + "\n")
    return 0
