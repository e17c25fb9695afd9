"""Programs in Python, NumPy, C, JavaScript, MATLAB and Julia: one file each, which needs nothing else."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence

from movimentum.equations import printing
from movimentum.equations.preludes import JAVASCRIPT, JULIA, MATLAB, PYTHON, C
from movimentum.equations.printing import Printer
from movimentum.equations.program import (
    BranchSign,
    ContinuousTurn,
    MotionProgram,
    NamedValue,
    NewtonLoop,
    StageProgram,
    Statement,
    needed,
)
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Language:
    """How a language writes what a program is made of: a sequence, an assignment, a step of Newton's method.

    ``row`` brackets numbers; ``declared`` is what stands before a new name; ``end`` behind a statement; ``first`` is
    the number of an array's first place.
    """

    printer: Callable[[], Printer]
    row: tuple[str, str]
    matrix: tuple[str, str, str]
    declared: str
    end: str
    test: tuple[str, str, str]
    loop: tuple[str, str]
    at: str
    first: int = 0


LANGUAGES = {
    "python": Language(printing.python_printer, ("[", "]"), ("[", ", ", "]"), "", "", ("if {}:", "elif {}:", ""),
                       ("for _ in range(40):", ""), "[{}]"),
    "c": Language(printing.c_printer, ("(double[]){", "}"), ("(double[]){", ", ", "}"), "double ", ";",
                  ("if ({}) {{", "}} else if ({}) {{", "}"), ("for (int pass = 0; pass < 40; pass++) {", "}"), "[{}]"),
    "javascript": Language(printing.javascript_printer, ("[", "]"), ("[", ", ", "]"), "let ", ";",
                           ("if ({}) {{", "}} else if ({}) {{", "}"), ("for (let pass = 0; pass < 40; pass++) {", "}"),
                           "[{}]"),
    "matlab": Language(printing.matlab_printer, ("[", "]"), ("[", "; ", "]"), "", ";", ("if {}", "elseif {}", "end"),
                       ("for pass = 1:40", "end"), "({})", 1),
    "julia": Language(printing.julia_printer, ("[", "]"), ("[", "; ", "]"), "", "", ("if {}", "elseif {}", "end"),
                      ("for pass in 1:40", "end"), "[{}]", 1),
}  # fmt: skip


def numbers(values: Sequence[float], language: Language) -> str:
    """A sequence of numbers."""
    return language.row[0] + ", ".join(map(repr, values)) + language.row[1]


class CodeWriter:
    """Writes the body of a program in one language. ``following`` (Python and JavaScript): the body keeps what goes on
    from one call to the next in the dict ``memory_``, and begins there instead of at its tables.
    """

    def __init__(self, name: str, *, following: bool = False) -> None:
        self.name, self.language, self.following = name, LANGUAGES[name], following
        self.text = self.language.printer()

    def stage(self, stage: StageProgram, target: str) -> Iterator[str]:
        """A step's statements, its outputs in ``target``."""
        lines = [line for statement in needed(stage) for line in self.statement(statement)]
        values = [self.text(output) for output in stage.outputs]
        if any(re.search(r"\btau\b", line) for line in (*lines, *values)):
            yield self.let("tau", f"t - {stage.start!r}")
        yield from lines
        if self.name == "c":
            for k, value in enumerate(values):
                yield f"{target}[{k}] = {value};"
        else:
            left, right = self.language.row if self.name != "matlab" else ("[", "]")
            yield f"{target} = {left}{', '.join(values)}{right}{self.language.end}"

    def let(self, name: str, value: str) -> str:
        """An assignment to a new name."""
        return f"{self.language.declared}{name} = {value}{self.language.end}"

    def statement(self, one: Statement) -> Iterator[str]:
        """The lines of a statement."""
        language = self.language
        match one:
            case NamedValue():
                yield self.let(one.name, self.text(one.value))
            case BranchSign():
                sign = repr(one.values[0]) if len(one.values) == 1 else self.call("lookup", one.times, one.values)
                yield self.let(one.name, f"{sign} * {self.begun(one.name, '1.0')}" if self.following else sign)
            case ContinuousTurn():
                near = self.begun(one.name, self.call("between", one.times, one.values))
                yield self.let(one.name, f"turned({self.text(one.y)}, {self.text(one.x)}, {near})")
                yield from self.kept((one.name,))
            case NewtonLoop():
                for k, name in enumerate(one.names):
                    start = self.call("between", one.times, [row[k] for row in one.values])
                    yield self.let(name, self.begun(name, start))
                yield language.loop[0]
                yield from ("    " + line for line in self.newton(one))
                if language.loop[1]:
                    yield language.loop[1]
                yield from self.kept(one.names)

    def begun(self, name: str, start: str) -> str:
        """What is remembered under a name, or else ``start``."""
        if not self.following:
            return start
        asked = f'memory_.get("{name}", {{}})' if self.name == "python" else f"(memory_.{name} ?? {{}})"
        return asked.format(start)

    def kept(self, names: Sequence[str]) -> Iterator[str]:
        """Remember these."""
        for name in names if self.following else ():
            yield f'memory_["{name}"] = {name}{self.language.end}'

    def call(self, function: str, times: Sequence[float], values: Sequence[float]) -> str:
        """A look into a table."""
        count = f"{len(times)}, " if self.name == "c" else ""
        return f"{function}({count}{numbers(times, self.language)}, {numbers(values, self.language)}, tau)"

    def newton(self, loop: NewtonLoop) -> Iterator[str]:
        """One step of Newton's method, and when to stop."""
        language = self.language
        m = len(loop.names)
        rows = [", ".join(self.text(each) for each in row) for row in loop.slopes]
        right = ", ".join(self.text(each) for each in loop.residuals)
        if self.name == "c":
            yield f"double rows_[] = {{{', '.join(rows)}}}, step_[] = {{{right}}};"
            yield f"double size_ = eliminate({m}, rows_, step_);"
        elif self.name == "matlab":
            yield f"step_ = [{'; '.join(rows)}] \\ [{'; '.join(right.split(', ')) if m == 1 else _column(self, loop)}];"
            yield "size_ = max(abs(step_));"
        elif self.name == "julia":
            yield f"step_ = eliminate([{', '.join(f'[{row}]' for row in rows)}], [{right}])"
            yield "size_ = maximum(abs.(step_))"
        else:
            bracketed = ", ".join(f"[{row}]" for row in rows)
            yield self.let("step_", f"eliminate([{bracketed}], [{right}])")
            yield self.let(
                "size_", "Math.max(...step_.map(Math.abs))" if self.name == "javascript" else "max(map(abs, step_))"
            )
        for k, name in enumerate(loop.names):
            place = language.at.format(k + language.first)
            yield f"{name} = {name} - step_{place}{language.end}"
        small = {"python": "if size_ < 1e-14:", "matlab": "if size_ < 1e-14", "julia": "if size_ < 1e-14"}
        if self.name in small:
            yield small[self.name]
            yield "    break"
            if self.name != "python":
                yield "end"
        else:
            yield "if (size_ < 1e-14) break;"


def _column(writer: CodeWriter, loop: NewtonLoop) -> str:
    return "; ".join(writer.text(each) for each in loop.residuals)


def _stages(writer: CodeWriter, program: MotionProgram, target: str) -> Iterator[str]:
    """All steps: the last one that has begun is it."""
    first, other, end = writer.language.test
    stages = program.stages
    if len(stages) == 1:
        yield from writer.stage(stages[0], target)
        return
    for k, stage in enumerate(stages):
        if k + 1 < len(stages):
            yield (first if k == 0 else other).format(f"t < {stages[k + 1].start!r}")
        else:
            yield {"python": "else:", "matlab": "else", "julia": "else"}.get(writer.name, "} else {")
        yield from ("    " + line for line in writer.stage(stage, target))
    if end:
        yield end


def _indented(lines: Iterator[str], by: str = "    ") -> str:
    return "\n".join(by + line for line in lines)


def python_code(program: MotionProgram, *, arrays: bool = False) -> str:
    """A Python module: ``pose(t, R=50.0)``; with ``arrays`` also ``poses(times)``, of NumPy."""
    constants = "".join(f", {name}={value!r}" for name, value in program.constants)
    body = _indented(_stages(CodeWriter("python"), program, "found_"))
    names = ",\n    ".join(map(json.dumps, program.names))
    passed = "".join(f", {name}={name}" for name, _ in program.constants)
    more = NUMPY.format(constants=constants, passed=passed) if arrays else ""
    head = "import numpy as np\n" if arrays else ""
    docstring = '    """Where everything is at time t: a dict by name."""'
    begun = f"NAMES = (\n    {names},\n)\n\n\ndef pose(t{constants}):\n{docstring}"
    return f"{PYTHON.format(head=head)}\n{begun}\n{body}\n    return dict(zip(NAMES, found_))\n{more}"


NUMPY = '''

def poses(times{constants}):
    """The same at many times: a dict of arrays (F,)."""
    found = [pose(float(t){passed}) for t in np.ravel(times)]
    return {{name: np.array([one[name] for one in found]) for name in NAMES}}
'''


def following_python(stage: StageProgram, constants: Sequence[str]) -> str:
    """A Python function ``values(t, constants, memory_)`` of one step: its outputs as a list."""
    taken = "".join(f'    {name} = constants["{name}"]\n' for name in constants)
    body = _indented(CodeWriter("python", following=True).stage(stage, "found_"))
    return f"{PYTHON.format(head='')}\ndef values(t, constants, memory_):\n{taken}{body}\n    return found_\n"


def following_javascript(stages: Sequence[StageProgram], constants: Sequence[str]) -> str:
    """JavaScript functions ``(t, constants, memory_)`` in an array, one for each step, after what they stand on."""
    head, _, _ = JAVASCRIPT.partition("const NAMES")
    taken = f"const {{ {', '.join(constants)} }} = constants;"
    bodies = (_indented(CodeWriter("javascript", following=True).stage(stage, "const found_"), "") for stage in stages)
    functions = ",\n".join(f"(t, constants, memory_) => {{\n{taken}\n{body}\nreturn found_;\n}}" for body in bodies)
    return f"{head.format()}const STAGES = [{functions}];\n"


def numpy_code(program: MotionProgram) -> str:
    """A Python module with arrays."""
    return python_code(program, arrays=True)


def c_code(program: MotionProgram) -> str:
    """A C file: ``pose(t, &constants, out)``; with -DMAIN a program that prints a table of the times given."""
    names = ",\n    ".join(map(json.dumps, program.names))
    fields = " ".join(f"double {name};" for name, _ in program.constants) or "char none;"
    values = ", ".join(repr(value) for _, value in program.constants) or "0"
    body = _indented(_stages(CodeWriter("c"), program, "out_"))
    used = {name for name, _ in program.constants if re.search(rf"\b{name}\b", body)}
    lines = [f"    double {name} = given_->{name};" for name, _ in program.constants if name in used]
    lines += [f"    (void){name};" for name in ("t", "given_") if not re.search(rf"\b{name}\b", f"{body}{lines}")]
    taken = "\n".join(lines)
    return C.format(count=len(program.names), names=names, fields=fields, values=values, taken=taken, body=body)


def javascript_code(program: MotionProgram) -> str:
    """JavaScript: ``pose(t, {R: 60})`` gives an object by name."""
    constants = ", ".join(f"{name} = {value!r}" for name, value in program.constants)
    names = ",\n  ".join(map(json.dumps, program.names))
    body = _indented(_stages(CodeWriter("javascript"), program, "found_"), "  ")
    return JAVASCRIPT.format(constants=constants, names=names, body=body)


def matlab_code(program: MotionProgram) -> str:
    """MATLAB or Octave: ``[values, names] = pose(t)``; constants in a struct."""
    names = ", ".join("'" + name.replace("'", "''") + "'" for name in program.names)
    given = "\n".join(
        f"  {name} = {value!r};\n  if nargin > 1 && isfield(given_, '{name}'), {name} = given_.{name}; end"
        for name, value in program.constants
    )
    body = _indented(_stages(CodeWriter("matlab"), program, "values_"), "  ")
    return MATLAB.format(names=names, given=given, body=body)


def julia_code(program: MotionProgram) -> str:
    """Julia: ``pose(t; R=60.0)`` gives a Dict by name."""
    constants = ", ".join(f"{name}={value!r}" for name, value in program.constants)
    names = ", ".join(map(json.dumps, program.names)).replace("$", "\\$")
    body = _indented(_stages(CodeWriter("julia"), program, "found_"))
    return JULIA.format(constants=f"; {constants}" if constants else "", names=names, body=body)
