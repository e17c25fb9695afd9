"""From a script to its products: the only package that knows all stages.

`read` reads the script and `stages` runs the stages in order. Every other module serves one command. A stage is
imported where it is called, so that a command imports only what it uses: `check` imports no rendering, and a script
that cannot be parsed imports no solver.
"""
