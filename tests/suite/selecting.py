"""What other solvers make of a choice of tests: CP-SAT of ortools, and outer approximation over HiGHS.

Reads requests, one JSON object per line, and answers each with one line of JSON.

The value of a choice of k tests is (1 - lambda) (k - 1) sum(quality) + 2 lambda sum(distance) / sqrt(dimensions). As
each test is in k - 1 pairs, that is a sum over pairs of (1 - lambda) (quality + quality) + 2 lambda distance / sqrt(...),
whatever k is. So one model of pairs covers all sizes. The value is concave only among choices of one size; tangent
planes are therefore asked for one size after another.
"""

import json
import os
import sys
import time

import numpy as np


class Choice:
    """What is chosen from."""

    def __init__(self, request):
        points = np.array(request["points"])
        share = request["lambda"]
        self.qualities = (1 - share) * np.array(request["qualities"])
        squares = (points[:, None, :] - points[None, :, :]) ** 2
        self.pairs = 2 * share * np.sqrt(squares.sum(axis=2)) / np.sqrt(points.shape[1])
        self.costs = np.array(request["costs"])
        self.budget = request["budget"]
        self.count = len(points)
        # Never more tests than fit if they are the cheapest ones.
        self.most = int((np.cumsum(np.sort(self.costs)) <= self.budget * (1 + 1e-9)).sum())
        self.unit = bool((self.costs == 1).all())

    def value(self, at):
        """The value of a choice, given as zeros and ones."""
        return float((at.sum() - 1) * (self.qualities @ at) + 0.5 * at @ self.pairs @ at)


def cp_sat(choice, limit):
    """A variable for each pair, or, where these would be too many, one for what each chosen test adds with the others."""
    from ortools.sat.python import cp_model

    scale = 10**7
    count, most = choice.count, choice.most
    start = time.perf_counter()
    model = cp_model.CpModel()
    chosen = [model.new_bool_var("") for _ in range(count)]
    if choice.unit:
        model.add(sum(chosen) == most)
    else:
        model.add(sum(int(c) * x for c, x in zip(choice.costs, chosen)) <= int(choice.budget))
        model.add(sum(chosen) <= most)
    both_ways = choice.qualities[:, None] + choice.qualities[None, :] + choice.pairs
    between = np.rint(both_ways * scale).astype(int)
    objective = []
    if count <= 200:
        both = {(i, j): model.new_bool_var("") for i in range(count) for j in range(i)}
        for (i, j), pair in both.items():
            model.add_implication(pair, chosen[i])
            model.add_implication(pair, chosen[j])
            objective.append(int(between[i, j]) * pair)
        # Each chosen test is in as many pairs as others are chosen, without which the relaxation is of no use.
        for i in range(count):
            pairs = sum(both[max(i, j), min(i, j)] for j in range(count) if j != i)
            if choice.unit:
                model.add(pairs == (most - 1) * chosen[i])
            else:
                model.add(pairs <= (most - 1) * chosen[i])
                # What is left of the budget once this test is bought is for the others.
                rest = int(choice.budget - choice.costs[i])
                spent = sum(int(choice.costs[j]) * both[max(i, j), min(i, j)] for j in range(count) if j != i)
                model.add(spent <= max(rest, 0) * chosen[i])
    else:
        for i in range(count):
            others = np.delete(between[i], i)
            bound = int(np.sort(others)[-(most - 1) :].sum())
            added = model.new_int_var(0, bound, "")
            model.add(added <= bound * chosen[i])
            model.add(2 * added <= sum(int(w) * x for j, (w, x) in enumerate(zip(between[i], chosen)) if j != i))
            objective.append(added)
    model.maximize(sum(objective))
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = max(limit - (time.perf_counter() - start), 1.0)
    solver.parameters.num_workers = 2
    solver.parameters.random_seed = 1
    status = solver.solve(model)
    seconds = time.perf_counter() - start
    found = status in (cp_model.OPTIMAL, cp_model.FEASIBLE)
    at = np.array([1.0 if found and solver.value(x) else 0.0 for x in chosen])
    return seconds, at, solver.best_objective_bound / scale, status == cp_model.OPTIMAL


class Tangents:
    """Choices of one size: tangent planes of the concave objective, first of the relaxation."""

    def __init__(self, choice, size):
        import highspy

        self.highspy, self.choice, self.size = highspy, choice, size
        self.own = (size - 1) * choice.qualities
        count = choice.count
        self.solver = solver = highspy.Highs()
        solver.silent()
        solver.setOptionValue("threads", 2)
        self.columns = np.arange(count + 1, dtype=np.int32)
        infinity = highspy.kHighsInf
        solver.addVars(count + 1, np.zeros(count + 1), np.append(np.ones(count), infinity))
        solver.changeColCost(count, 1.0)
        solver.changeObjectiveSense(highspy.ObjSense.kMaximize)
        solver.addRow(size, size, count, self.columns[:count], np.ones(count))
        if not choice.unit:
            solver.addRow(0, choice.budget, count, self.columns[:count], choice.costs)
        # The best tests and as many of the greatest distances: what holds before anything is solved.
        best = np.sort(self.own)[-size:].sum() + size * (size - 1) / 2 * choice.pairs.max()
        self.bound = float(best)

    def value(self, at):
        return self.own @ at + 0.5 * at @ self.choice.pairs @ at

    def cut(self, at):
        slope = self.own + self.choice.pairs @ at
        level = self.value(at) - slope @ at
        infinity = self.highspy.kHighsInf
        self.solver.addRow(-infinity, level, len(slope) + 1, self.columns, np.append(-slope, 1.0))

    def start(self):
        """A choice that fits, after the best exchanges of one test for another."""
        costs, budget = self.choice.costs, self.choice.budget * (1 + 1e-9)
        order = np.lexsort((-self.own, costs)) if not self.choice.unit else np.argsort(-self.own)
        inside = list(order[: self.size])
        if costs[inside].sum() > budget:
            return None
        while True:
            at = np.zeros(self.choice.count)
            at[inside] = 1
            slope = self.own + self.choice.pairs @ at
            gain = slope[None, :] - slope[inside][:, None] - self.choice.pairs[inside]
            gain[:, inside] = -np.inf
            gain[costs[inside].sum() - costs[inside][:, None] + costs[None, :] > budget] = -np.inf
            best = np.unravel_index(gain.argmax(), gain.shape)
            if not gain[best] > 1e-12:
                return at
            inside[best[0]] = int(best[1])

    def relax(self, until):
        while time.perf_counter() < until:
            self.solver.run()
            solution = np.array(self.solver.getSolution().col_value)
            self.bound = min(self.bound, solution[self.choice.count])
            if self.bound - self.value(solution[: self.choice.count]) <= 1e-7 * self.bound:
                return
            self.cut(solution[: self.choice.count])

    def prove(self, best, until):
        """Mixed-integer programs with all planes, until none is better than the best; gives the best choice."""
        status = self.highspy.HighsModelStatus
        for i in range(self.choice.count):
            self.solver.changeColIntegrality(i, self.highspy.HighsVarType.kInteger)
        self.solver.setOptionValue("mip_rel_gap", 1e-9)
        while self.bound > self.choice.value(best) * (1 + 1e-8) and time.perf_counter() < until:
            self.solver.setOptionValue("time_limit", max(until - time.perf_counter(), 0.1))
            self.solver.run()
            self.bound = min(self.bound, self.solver.getInfo().mip_dual_bound)
            if self.solver.getModelStatus() == status.kOptimal:
                at = np.rint(np.array(self.solver.getSolution().col_value)[: self.choice.count])
                if self.choice.value(at) > self.choice.value(best):
                    best = at
                self.cut(at)
            elif self.solver.getModelStatus() == status.kInfeasible:
                self.bound = 0.0
        return best


def highs(choice, limit):
    """All sizes that may be worth it: their relaxations first, then the most promising one."""
    start = time.perf_counter()
    until = start + limit
    best = np.zeros(choice.count)
    open_sizes = []
    for size in [choice.most] if choice.unit else range(choice.most, 1, -1):
        tangents = Tangents(choice, size)
        at = tangents.start()
        if at is None:
            continue
        if choice.value(at) > choice.value(best):
            best = at
        tangents.cut(at)
        open_sizes.append(tangents)
    for tangents in open_sizes:
        if tangents.bound > choice.value(best):
            tangents.relax(until)
    open_sizes.sort(key=lambda tangents: -tangents.bound)
    for tangents in open_sizes:
        best = tangents.prove(best, until)
    bound = max([choice.value(best)] + [tangents.bound for tangents in open_sizes])
    proved = bound <= choice.value(best) * (1 + 1e-8)
    return time.perf_counter() - start, best, bound, proved


def main():
    # HiGHS prints its version to standard output, which is for answers.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        request = json.loads(line)
        choice = Choice(request)
        solve = {"cp-sat": cp_sat, "highs": highs}[request["solver"]]
        seconds, at, bound, proved = solve(choice, request["seconds"])
        value = choice.value(at) if at.any() else 0.0
        print(json.dumps({"seconds": seconds, "value": value, "bound": float(bound), "proved": bool(proved)}), file=answers, flush=True)


main()
