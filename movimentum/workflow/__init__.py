"""From a script to its products: the only package that knows all stages.

`read` reads the script and `stages` runs the stages in order. Every other module serves one command. Stages are
imported where they are called, so a command imports only what it uses: `check` imports no rendering, and a script with
a syntax error imports no solver.
"""
