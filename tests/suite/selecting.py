"""What other solvers make of a choice of tests: CP-SAT of ortools, and outer approximation over HiGHS.

Reads requests, one JSON object per line, and answers each with one line of JSON.
"""

import json
import sys
import time

import numpy as np


def weights(request):
    """What each test adds by itself, and what each pair adds."""
    points = np.array(request["points"])
    size, share = request["size"], request["lambda"]
    squares = (points[:, None, :] - points[None, :, :]) ** 2
    pairs = 2 * share * np.sqrt(squares.sum(axis=2)) / np.sqrt(points.shape[1])
    return (1 - share) * (size - 1) * np.array(request["qualities"]), pairs


def cp_sat(own, pairs, size, limit):
    """A variable for each pair, or, where these would be too many, one for what each chosen test adds with the others."""
    from ortools.sat.python import cp_model

    scale = 10**7
    count = len(own)
    start = time.perf_counter()
    model = cp_model.CpModel()
    chosen = [model.new_bool_var("") for _ in range(count)]
    model.add(sum(chosen) == size)
    whole = np.rint(own * scale).astype(int)
    between = np.rint(pairs * scale).astype(int)
    objective = [int(whole[i]) * chosen[i] for i in range(count)]
    if count <= 200:
        both = {(i, j): model.new_bool_var("") for i in range(count) for j in range(i)}
        for (i, j), pair in both.items():
            model.add_implication(pair, chosen[i])
            model.add_implication(pair, chosen[j])
            objective.append(int(between[i, j]) * pair)
        # Each chosen test is in size - 1 pairs, without which the relaxation is of no use.
        for i in range(count):
            model.add(sum(both[max(i, j), min(i, j)] for j in range(count) if j != i) == (size - 1) * chosen[i])
    else:
        for i in range(count):
            most = int(np.sort(between[i])[-(size - 1) :].sum())
            added = model.new_int_var(0, most, "")
            model.add(added <= most * chosen[i])
            model.add(2 * added <= sum(int(w) * x for w, x in zip(between[i], chosen)))
            objective.append(added)
    model.maximize(sum(objective))
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = max(limit - (time.perf_counter() - start), 1.0)
    solver.parameters.num_workers = 2
    solver.parameters.random_seed = 1
    status = solver.solve(model)
    seconds = time.perf_counter() - start
    found = status in (cp_model.OPTIMAL, cp_model.FEASIBLE)
    subset = [i for i in range(count) if found and solver.value(chosen[i])]
    return seconds, subset, solver.best_objective_bound / scale, status == cp_model.OPTIMAL


def highs(own, pairs, size, limit):
    """Tangent planes of the concave objective: first on the relaxation, then mixed-integer programs with all planes."""
    import highspy

    count = len(own)
    start = time.perf_counter()
    solver = highspy.Highs()
    solver.silent()
    solver.setOptionValue("threads", 2)
    infinity = highspy.kHighsInf
    columns = np.arange(count + 1, dtype=np.int32)
    solver.addVars(count + 1, np.zeros(count + 1), np.append(np.ones(count), infinity))
    solver.changeColCost(count, 1.0)
    solver.changeObjectiveSense(highspy.ObjSense.kMaximize)
    solver.addRow(size, size, count, columns[:count], np.ones(count))

    def value(at):
        return own @ at + 0.5 * at @ pairs @ at

    def cut(at):
        slope = own + pairs @ at
        solver.addRow(-infinity, value(at) - slope @ at, count + 1, columns, np.append(-slope, 1.0))

    def exchanged(subset):
        """The subset after the best exchanges of one test for another."""
        inside = list(subset)
        while True:
            at = np.zeros(count)
            at[inside] = 1
            slope = own + pairs @ at
            gain = slope[None, :] - slope[inside][:, None] - pairs[inside]
            gain[:, inside] = -np.inf
            best = np.unravel_index(gain.argmax(), gain.shape)
            if gain[best] <= 1e-12:
                return at
            inside[best[0]] = int(best[1])

    best = exchanged(np.argsort(-own)[:size])
    bound = infinity
    cut(best)
    while time.perf_counter() - start < limit:
        solver.run()
        solution = np.array(solver.getSolution().col_value)
        bound = min(bound, solution[count])
        if bound - value(solution[:count]) <= 1e-7 * bound:
            break
        cut(solution[:count])
    for i in range(count):
        solver.changeColIntegrality(i, highspy.HighsVarType.kInteger)
    solver.setOptionValue("mip_rel_gap", 1e-9)
    proved = False
    while not proved and time.perf_counter() - start < limit:
        solver.setOptionValue("time_limit", limit - (time.perf_counter() - start))
        solver.run()
        bound = min(bound, solver.getInfo().mip_dual_bound)
        if solver.getModelStatus() == highspy.HighsModelStatus.kOptimal:
            at = np.rint(np.array(solver.getSolution().col_value)[:count])
            if value(at) > value(best):
                best = at
            cut(at)
        proved = bound <= value(best) * (1 + 1e-8)
    return time.perf_counter() - start, np.flatnonzero(best > 0.5), bound, proved


def main():
    for line in sys.stdin:
        request = json.loads(line)
        own, pairs = weights(request)
        solve = {"cp-sat": cp_sat, "highs": highs}[request["solver"]]
        seconds, subset, bound, proved = solve(own, pairs, request["size"], request["seconds"])
        at = np.zeros(len(own))
        at[list(subset)] = 1
        value = float(own @ at + 0.5 * at @ pairs @ at)
        print(json.dumps({"seconds": seconds, "value": value, "bound": float(bound), "proved": bool(proved)}))


main()
