"""What other solvers make of a choice of tests: CP-SAT of ortools, and outer approximation over HiGHS.

Reads requests, one JSON object per line, and answers each with one line of JSON: {"Ok": {…}}, or {"Err": "why not"}.

Chosen are at least two tests whose costs are within the budget, of any number, with the greatest

    (1 − λ) (number − 1) Σ quality + 2 λ Σ distance / √dimensions,

as `Problem::value` of sesame-select has it.

For one number of tests this is concave: it is linear but for the distances, and a matrix of Euclidean distances is
negative semidefinite on vectors whose sum is 0. Over all numbers it is not, so that tangent planes would cut off good
choices. Both solvers are therefore asked for one number after the other, those with the greatest bounds first, and not
at all for numbers that are bounded by what was found already. All numbers share the time limit.

Both get what helps them: the tangent planes of the relaxation, a good choice to begin with as what has to be reached,
and no tests that reduced costs of the relaxation exclude.
"""

import json
import multiprocessing
import sys
import time

import numpy as np

# Relative; what is nearer is equal.
EQUAL = 1e-8
# Up to so many tests there is a variable for each pair of them.
PAIRED = 200
# From more tests a model of CP-SAT would have too many terms, the square of them; each takes some hundred bytes.
TERMS = 3000
# Tangent planes in a model of CP-SAT; the last ones are the nearest to the optimum of the relaxation.
PLANES = 30


class Problem:
    """What is chosen from, what is known so far, and when to stop."""

    def __init__(self, request):
        self.axes = np.array(request["points"]).T
        self.quality = (1 - request["lambda"]) * np.array(request["qualities"])
        self.cost = np.array(request["costs"])
        # As in sesame-select, with room for the rounding of sums.
        self.budget = request["budget"] * (1 + 1e-9)
        self.weight = 2 * request["lambda"] / np.sqrt(len(self.axes))
        self.count = len(self.cost)
        self.kept = None
        if self.count <= 2000:
            self.kept = self.rows(range(self.count))
        self.best, self.chosen = 0.0, np.zeros(0, dtype=int)
        self.start = time.perf_counter()
        self.end = self.start + request["seconds"]

    def left(self):
        return self.end - time.perf_counter()

    def rows(self, these):
        """What each pair with one of these tests adds. The matrix of ten thousand tests would fill 800 MB."""
        if self.kept is not None:
            return self.kept[these]
        squares = sum((axis[these, None] - axis[None, :]) ** 2 for axis in self.axes)
        return self.weight * np.sqrt(squares)

    def sizes(self):
        """The numbers of tests that can be best: where all costs are equal, each test more is worth something."""
        most = int(np.searchsorted(np.cumsum(np.sort(self.cost)), self.budget, side="right"))
        least = most if self.cost.min() == self.cost.max() else 2
        return range(most, max(least, 2) - 1, -1)


class Size:
    """All choices of one number of tests: the relaxation, and what is known of it."""

    def __init__(self, problem, size):
        import highspy

        self.problem, self.size = problem, size
        self.own = (size - 1) * problem.quality
        self.planes = []
        self.bound = np.inf
        count = problem.count
        # A test is affordable only together with the cheapest others.
        order = np.argsort(problem.cost, kind="stable")
        others = problem.cost[order[: size - 1]].sum()
        self.usable = problem.cost + others <= problem.budget
        self.usable[order[:size]] = True
        self.solver = highspy.Highs()
        self.solver.silent()
        self.solver.setOptionValue("threads", 2)
        self.solver.setOptionValue("random_seed", 1)
        self.columns = np.arange(count + 1, dtype=np.int32)
        self.solver.addVars(count + 1, np.zeros(count + 1), np.append(self.usable.astype(float), np.inf))
        self.solver.changeColCost(count, 1.0)
        self.solver.changeObjectiveSense(highspy.ObjSense.kMaximize)
        self.solver.addRow(size, size, count, self.columns[:count], np.ones(count))
        self.solver.addRow(-np.inf, problem.budget, count, self.columns[:count], problem.cost)
        self.offer(order[:size])

    def around(self, at):
        """The value, and its slope."""
        support = np.flatnonzero(at)
        between = at[support] @ self.problem.rows(support)
        return self.own @ at + 0.5 * between @ at, self.own + between

    def cut(self, at):
        value, slope = self.around(at)
        constant = value - slope @ at
        self.planes.append((constant, slope))
        self.solver.addRow(-np.inf, constant, len(self.columns), self.columns, np.append(-slope, 1.0))

    def offer(self, chosen):
        """Improves a choice by the best exchanges of one test for another, and keeps it if it is the best."""
        problem, inside = self.problem, list(chosen)
        if len(inside) != self.size or problem.cost[inside].sum() > problem.budget:
            return
        while True:
            at = np.zeros(problem.count)
            at[inside] = 1
            value, slope = self.around(at)
            gain = slope[None, :] - slope[inside][:, None] - problem.rows(inside)
            spent = problem.cost[inside].sum()
            gain[spent - problem.cost[inside][:, None] + problem.cost[None, :] > problem.budget] = -np.inf
            gain[:, inside] = -np.inf
            best = np.unravel_index(gain.argmax(), gain.shape)
            if gain[best] <= 1e-12:
                break
            inside[best[0]] = int(best[1])
        if not self.planes:
            self.cut(at)
        if value > problem.best:
            problem.best, problem.chosen = float(value), np.sort(inside)

    def open(self):
        """Whether a choice of this size may be better than the best one so far."""
        return self.bound > self.problem.best * (1 + EQUAL)

    def relax(self, until):
        """Tangent planes until they meet the relaxation, or show that no choice of this size is the best."""
        import highspy

        problem = self.problem
        count = problem.count
        while self.open():
            self.solver.setOptionValue("time_limit", max(until - time.perf_counter(), 1.0))
            self.solver.run()
            if self.solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
                return
            solution = self.solver.getSolution()
            at = np.array(solution.col_value)[:count]
            self.bound = min(self.bound, self.solver.getInfo().objective_function_value)
            # A test that the relaxation leaves out makes any choice with it worse by its reduced cost.
            worse = np.abs(np.array(solution.col_dual)[:count])
            self.usable &= ~((at <= 1e-9) & (self.bound - worse < problem.best * (1 - EQUAL)))
            at[at <= 1e-9] = 0
            value, _ = self.around(at)
            if self.bound - value <= 1e-7 * self.bound or time.perf_counter() > until:
                break
            self.cut(at)
        self.offer(np.argsort(-at, kind="stable")[: self.size])


def highs(size, _):
    """Mixed-integer programs with all tangent planes, and one more plane after each."""
    import highspy

    problem, solver = size.problem, size.solver
    count = problem.count
    for i in range(count):
        solver.changeColIntegrality(i, highspy.HighsVarType.kInteger)
        solver.changeColBounds(i, 0.0, float(size.usable[i]))
    solver.setOptionValue("mip_rel_gap", 1e-9)
    while size.open() and problem.left() > 0:
        # Less is of no interest.
        solver.changeColBounds(count, problem.best * (1 - EQUAL), np.inf)
        solver.setOptionValue("time_limit", problem.left())
        solver.run()
        status = solver.getModelStatus()
        if status == highspy.HighsModelStatus.kInfeasible:
            size.bound = min(size.bound, problem.best)
            return
        size.bound = min(size.bound, solver.getInfo().mip_dual_bound)
        if status != highspy.HighsModelStatus.kOptimal:
            return
        at = np.rint(np.array(solver.getSolution().col_value)[:count])
        size.offer(np.flatnonzero(at))
        size.cut(at)


def cp_sat(size, beside):
    """A variable for each pair of tests, or, where these would be too many, one for what each chosen test adds with
    the others; and the tangent planes."""
    problem = size.problem
    these = np.flatnonzero(size.usable)
    if len(these) > TERMS:
        raise MemoryError(f"a model of {len(these)}² terms does not fit memory")
    chosen, bound = beside.apply(
        cp_sat_model,
        (
            size.size,
            size.own[these],
            problem.rows(these)[:, these],
            problem.cost[these],
            problem.budget,
            [(constant, slope[these]) for constant, slope in size.planes[-PLANES:]],
            problem.best,
            np.isin(these, problem.chosen) if len(problem.chosen) == size.size else None,
            problem.left(),
        ),
    )
    size.offer(these[chosen])
    size.bound = min(size.bound, max(bound, problem.best))


def cp_sat_model(number, own, between, cost, budget, planes, best, hint, seconds):
    """What is chosen, and the bound. It runs in a process of its own: ortools brings a HiGHS that is not the
    one of highspy, and a process can load but one of them."""
    from ortools.sat.python import cp_model

    start = time.perf_counter()
    count = len(own)
    scale = 10**7
    # What all roundings of a choice's terms may add up to.
    room = number * number
    model = cp_model.CpModel()
    chosen = [model.new_bool_var("") for _ in range(count)]
    model.add(sum(chosen) == number)
    # Whole costs stay whole; others are rounded in favour of the solver.
    fine = 1 if (cost % 1 == 0).all() else 10**6
    cost = [int(c) for c in np.floor(cost * fine)]
    budget = int(budget * fine)
    uneven = len(set(cost)) > 1
    if uneven:
        model.add(sum(c * x for c, x in zip(cost, chosen)) <= budget)
    whole = np.rint(own * scale).astype(int).tolist()
    between = np.rint(between * scale).astype(int)
    variables, weights = list(chosen), whole
    if count <= PAIRED:
        both = {(i, j): model.new_bool_var("") for i in range(count) for j in range(i)}
        for (i, j), pair in both.items():
            model.add_implication(pair, chosen[i])
            model.add_implication(pair, chosen[j])
            variables.append(pair)
            weights.append(int(between[i, j]))
        for i in range(count):
            others = [(cost[j], both[max(i, j), min(i, j)]) for j in range(count) if j != i]
            # Each chosen test is in size - 1 pairs, without which the relaxation is of no use.
            model.add(sum(pair for _, pair in others) == (number - 1) * chosen[i])
            if uneven:
                # The budget once more, for what is chosen beside this test.
                model.add(sum(c * pair for c, pair in others) <= (budget - cost[i]) * chosen[i])
    else:
        for i in range(count):
            most = int(np.sort(between[i])[-(number - 1) :].sum())
            added = model.new_int_var(0, most, "")
            model.add(added <= most * chosen[i])
            model.add(2 * added <= cp_model.LinearExpr.weighted_sum(chosen, between[i].tolist()))
            variables.append(added)
            weights.append(1)
    objective = cp_model.LinearExpr.weighted_sum(variables, weights)
    model.add(objective >= int(best * scale) - room)
    for constant, slope in planes:
        plane = cp_model.LinearExpr.weighted_sum(chosen, np.ceil(slope * scale).astype(int).tolist())
        model.add(objective - plane <= int(np.ceil(constant * scale)) + room)
    if hint is not None:
        for variable, value in zip(chosen, hint.tolist()):
            model.add_hint(variable, value)
    model.maximize(objective)
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = max(seconds - (time.perf_counter() - start), 1.0)
    solver.parameters.num_workers = 2
    solver.parameters.random_seed = 1
    solver.parameters.linearization_level = 2
    status = solver.solve(model)
    if status == cp_model.INFEASIBLE:
        # The best choice so far has another number of tests, and no choice of this number reaches it.
        return [], best
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return [], np.inf
    found = [i for i in range(count) if solver.value(chosen[i])]
    # Proved is proved, whatever the roundings are.
    return found, -np.inf if status == cp_model.OPTIMAL else solver.best_objective_bound / scale


def solved(request, beside):
    problem = Problem(request)
    solve = {"cp-sat": cp_sat, "highs": highs}[request["solver"]]
    # Half of the time at most is for relaxations, those of the greatest sizes first.
    sizes = []
    numbers = problem.sizes()
    for done, number in enumerate(numbers):
        size = Size(problem, number)
        share = (problem.start + problem.end) / 2 - time.perf_counter()
        size.relax(time.perf_counter() + share / (len(numbers) - done))
        sizes.append(size)
    for size in sorted(sizes, key=lambda size: -size.bound):
        if size.open() and problem.left() > 0:
            solve(size, beside)
    seconds = time.perf_counter() - problem.start
    bound = max([problem.best] + [size.bound for size in sizes])
    proved = not any(size.open() for size in sizes)
    return {"seconds": seconds, "value": problem.best, "bound": float(bound), "proved": proved}


def main():
    import highspy  # noqa: F401: not while the clock runs

    with multiprocessing.get_context("spawn").Pool(1) as beside:
        beside.apply(loaded)
        for line in sys.stdin:
            try:
                print(json.dumps({"Ok": solved(json.loads(line), beside)}))
            except MemoryError as why:
                print(json.dumps({"Err": str(why)}))


def loaded():
    """Loads CP-SAT before it is asked for."""
    from ortools.sat.python import cp_model  # noqa: F401


if __name__ == "__main__":
    main()
