"""Graphs against networkx; decomposition of scenes whose structure is known."""

import networkx as nx
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.memo import Memo
from movimentum.planning.blocks.block_cache import BlockCache
from movimentum.planning.blocks.kinds import method_of
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.planning.structure.graph import groups, maximum_matching, reachable, strong_components
from movimentum.timeline.arrange import arrange
from tests.solver.scenes import scene_of

ROWS = st.integers(1, 12).flatmap(
    lambda columns: st.lists(st.lists(st.integers(0, columns - 1), max_size=5, unique=True), max_size=12).map(
        lambda rows: (rows, columns)
    )
)


@settings(max_examples=75)
@given(ROWS)
def test_matchings_are_maximum_and_consistent(case):
    rows, columns = case
    of_row, of_column = maximum_matching(rows, columns)
    for i, column in enumerate(of_row):
        assert column < 0 or (column in rows[i] and of_column[column] == i)
    graph = nx.Graph()
    graph.add_nodes_from([("r", i) for i in range(len(rows))], bipartite=0)
    graph.add_nodes_from([("c", j) for j in range(columns)], bipartite=1)
    graph.add_edges_from((("r", i), ("c", j)) for i, row in enumerate(rows) for j in row)
    best = nx.bipartite.maximum_matching(graph, top_nodes=[("r", i) for i in range(len(rows))])
    assert sum(column >= 0 for column in of_row) == len(best) // 2


@settings(max_examples=50)
@given(ROWS)
def test_earlier_rows_win(case):
    # the matched rows are the lexicographically first independent set: every prefix is matched as well as it can be
    rows, columns = case
    of_row, _ = maximum_matching(rows, columns)
    for end in range(len(rows) + 1):
        alone, _ = maximum_matching(rows[:end], columns)
        assert sum(c >= 0 for c in of_row[:end]) == sum(c >= 0 for c in alone)


GRAPHS = st.integers(1, 12).flatmap(
    lambda n: st.lists(st.lists(st.integers(0, n - 1), max_size=4), min_size=n, max_size=n)
)


@settings(max_examples=75)
@given(GRAPHS)
def test_strong_components_come_in_the_order_of_solving(successors):
    components = strong_components(successors)
    graph = nx.DiGraph()
    graph.add_nodes_from(range(len(successors)))
    graph.add_edges_from((i, j) for i, row in enumerate(successors) for j in row)
    assert {frozenset(c) for c in components} == {frozenset(c) for c in nx.strongly_connected_components(graph)}
    place = {node: k for k, component in enumerate(components) for node in component}
    assert all(place[j] <= place[i] for i, row in enumerate(successors) for j in row)
    assert reachable([0], successors) == {0} | nx.descendants(graph, 0)
    links = [(i, j) for i, row in enumerate(successors) for j in row]
    assert {frozenset(g) for g in groups(len(successors), links)} == {
        frozenset(c) for c in nx.weakly_connected_components(graph)
    }


def test_a_long_chain_needs_no_recursion():
    count = 50_000
    assert len(strong_components([[i - 1] if i else [] for i in range(count)])) == count
    of_row, _ = maximum_matching([[i, i + 1] if i + 1 < count else [i] for i in range(count)], count)
    assert min(of_row) >= 0


def plan_of(text):
    scene = scene_of(text)
    return compile_structure(structure_of(scene, arrange(scene).segments[0], {}), 100.0, BlockCache(Memo(1)))


def kernels(plan):
    return sorted(method_of(block) for block in plan.blocks if method_of(block) != "assign")


def test_a_four_bar_is_one_dyad_and_a_slider_crank_one_quadratic():
    four_bar = plan_of("""Crank : .bar O=[0,0] P=[35,0]; Coupler : .bar A=[0,0] B=[80,10];
    Rocker : .bar O=[90,0] P=[90,60];
    @0 Crank.O=[0,0]; Crank.angle=90*.t; Rocker.O=[90,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P; @1""")
    assert kernels(four_bar) == ["dyad"]
    slider = plan_of("""Crank : .bar O=[0,0] P=[35,0]; Rod : .bar A=[0,0] B=[80,10];
    @0 Crank.O=[0,0]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,0]; @1""")
    assert kernels(slider) == ["dyad"] or kernels(slider) == ["polynomial"]


def test_a_blank_takes_its_equation_with_it():
    plan = plan_of("Bar : .bar P=[0,0] Q=[40,0]; @0 Bar.P=[10*.t,0]; Bar.angle=0; Bar.Q=Bar.P+[_,0]; @1")
    assert all("_" not in plan.system.unknowns[n].name for block in plan.blocks for n in block.unknowns)


def test_a_chain_of_loops_is_solved_loop_by_loop():
    count = 12
    things, joints = [], []
    for i in range(count):
        things.append(f"C{i} : .bar A=[0,0] B=[95,0]; R{i} : .bar O=[{100 * i + 100},0] P=[{100 * i + 100},60];")
        joints.append(f"R{i}.O=[{100 * i + 100},0]; C{i}.B=R{i}.P; C{i}.A={'Crank.P' if i == 0 else f'R{i - 1}.P'};")
    plan = plan_of(
        f"Crank : .bar O=[0,0] P=[20,0]; {' '.join(things)} @0 Crank.O=[0,0]; Crank.angle=90*.t; {' '.join(joints)} @1"
    )
    assert kernels(plan) == ["dyad"] * count
    assert max(len(block.unknowns) for block in plan.blocks) <= 8


def test_what_does_not_move_is_known_to_be_still():
    plan = plan_of("""A : .bar p=[0,0] q=[50,0]; B : .bar p=[60,0] q=[60,40]; Crank : .bar O=[0,0] P=[10,0];
    @0 A.p=[0,0]; B.p=[60,0]; A.q=B.q; Crank.O=[0,0]; Crank.angle=90*.t; @1""")
    moving = {plan.system.unknowns[n].name for block in plan.blocks if block.moving for n in block.unknowns}
    assert {"Crank.cos", "Crank.sin", "Crank.angle"} <= moving
    assert not any(name.startswith(("A.", "B.")) for name in moving)
