"""From a script to its products: the only package that knows all stages.

`read` gets the script and `stages` puts the stages in a row; every other verb is what one command asks for. A stage is
imported where it is called, so that a command pays for what it uses: checking imports no picture, and a script that
cannot be parsed imports no solver.
"""
