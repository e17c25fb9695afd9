"""Traversing expressions, and making others from them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator

from movimentum.expressions.expr import Expr, add, derivative, div, integral, mul, neg
from movimentum.expressions.operations import call, power


def walk(*roots: Expr) -> Iterator[Expr]:
    """Every distinct node below ``roots``, arguments before their users (no recursion)."""
    seen: set[Expr] = set()
    for root in roots:
        if not root.args:
            if root not in seen:
                seen.add(root)
                yield root
            continue
        stack: list[tuple[Expr, bool]] = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if node in seen:
                continue
            if ready or not node.args:
                seen.add(node)
                yield node
            else:
                stack.append((node, True))
                stack.extend((arg, False) for arg in reversed(node.args) if arg not in seen)


def symbols(*roots: Expr) -> set[Hashable]:
    """The payloads of all symbols below ``roots``."""
    return {node.payload for node in walk(*roots) if node.op == "symbol"}


def rebuild(node: Expr, args: tuple[Expr, ...]) -> Expr:
    """``node`` with other arguments, folded again."""
    if args == node.args:
        return node
    match node.op:
        case "add":
            return add(*args)
        case "mul":
            return mul(*args)
        case "div":
            return div(*args)
        case "neg":
            return neg(*args)
        case "pow":
            return power(args[0], node.exponent)
        case "integral":
            return integral(args[0], node.start)
        case "derivative":
            return derivative(args[0])
        case _:
            return call(node.op, *args)


def substitute(root: Expr, replace: Callable[[Expr], Expr | None], memo: dict[Expr, Expr] | None = None) -> Expr:
    """``root`` with every node for which ``replace`` returns an expression replaced by it.

    ``replace`` sees leaves, integrals and derivatives; pass one ``memo`` to share work between roots.
    """
    memo = {} if memo is None else memo
    for node in walk(root):
        if node in memo:
            continue
        new = replace(node) if not node.args or node.op in ("integral", "derivative") else None
        memo[node] = rebuild(node, tuple(memo[arg] for arg in node.args)) if new is None else new
    return memo[root]
