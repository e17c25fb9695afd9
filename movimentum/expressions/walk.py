"""Traverses and transforms expressions."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator

from movimentum.expressions.expr import Expr, add, derivative, div, integral, mul, neg
from movimentum.expressions.operations import call, power


def walk(*roots: Expr, seen: set[Expr] | None = None) -> Iterator[Expr]:
    """Every distinct node below ``roots``, arguments before their users (no recursion).

    Nodes that are in ``seen`` are left out, with all below them; the others are added to it.
    """
    seen = set() if seen is None else seen
    for root in roots:
        if root in seen:
            continue
        seen.add(root)
        if not root.args:
            yield root
            continue
        stack = [(root, iter(root.args))]
        while stack:
            node, rest = stack[-1]
            for arg in rest:
                before = len(seen)
                seen.add(arg)  # its hash is asked for once only: this loop is most of what planning costs
                if len(seen) == before:
                    continue
                if arg.args:
                    stack.append((arg, iter(arg.args)))
                    break
                yield arg
            else:
                stack.pop()
                yield node


def symbols(*roots: Expr) -> frozenset[Hashable]:
    """The payloads of all symbols below ``roots``."""
    if len(roots) == 1:
        return _symbols_below(roots[0])
    return frozenset[Hashable]().union(*map(_symbols_below, roots))


_NONE: frozenset[Hashable] = frozenset()


def _symbols_below(root: Expr) -> frozenset[Hashable]:
    if root.symbols_below is None:
        if not root.args:
            root.symbols_below = frozenset((root.payload,)) if root.op == "symbol" else _NONE
            return root.symbols_below
        found: set[Hashable] = set()
        seen: set[int] = set()
        stack = [root]
        while stack:
            node = stack.pop()
            if node.symbols_below is not None:
                found |= node.symbols_below
            elif node.args:
                if id(node) not in seen:
                    seen.add(id(node))
                    stack.extend(node.args)
            elif node.op == "symbol":
                found.add(node.payload)
        root.symbols_below = frozenset(found)
    return root.symbols_below


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
            return power(args[0], node.exponent, node.origin)
        case "integral":
            return integral(args[0], node.start)
        case "derivative":
            return derivative(args[0])
        case "reduction":
            return Expr("reduction", args, node.payload)
        case _:
            return call(node.op, *args, payload=node.payload)


_SEEN = frozenset({"integral", "derivative", "nearest", "nearest-turned"})


def substitute(root: Expr, replace: Callable[[Expr], Expr | None], memo: dict[Expr, Expr] | None = None) -> Expr:
    """``root`` with every node for which ``replace`` returns an expression replaced by it.

    ``replace`` sees leaves, integrals, derivatives, places of contact; pass one ``memo`` to share work between roots.
    """
    memo = {} if memo is None else memo
    for node in walk(root):
        if node in memo:
            continue
        new = replace(node) if not node.args or node.op in _SEEN else None
        memo[node] = rebuild(node, tuple(memo[arg] for arg in node.args)) if new is None else new
    return memo[root]


def named_origins(root: Expr, known: dict[int, tuple[Expr, frozenset[Hashable]]] | None = None) -> frozenset[Hashable]:
    """The symbols that the constants in an expression were computed from (see `Expr.origin`). ``known``: by the number
    of an origin (equal ones may come from others), which is kept for as long.
    """
    known = {} if known is None else known
    found: frozenset[Hashable] = frozenset()
    for node in walk(root):
        if node.origin is None:
            continue
        if id(node.origin) not in known:
            known[id(node.origin)] = node.origin, symbols(node.origin) | named_origins(node.origin, known)
        found |= known[id(node.origin)][1]
    return found
