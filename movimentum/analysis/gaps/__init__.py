"""Which things overlap in a film, when and how deep: `check --gaps`, and claims about `.gap` between frames."""
