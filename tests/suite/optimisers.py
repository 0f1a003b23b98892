"""What other implementations of NSGA-II make of published problems, and pymoo of sorting, crowding and distances.

Reads requests, one JSON object per line, and answers each with one line of JSON.
"""

import json
import sys
import time

import numpy as np


def pygmo_run(problem, population, evaluations, seed):
    import pygmo as pg

    udp = pg.dtlz(2, 12, 3) if problem == "dtlz2" else pg.zdt(int(problem[3]), 30)
    variables = 12 if problem == "dtlz2" else 30
    start = time.perf_counter()
    members = pg.population(pg.problem(udp), population, seed=seed)
    algorithm = pg.algorithm(
        pg.nsga2(gen=evaluations // population - 1, cr=0.9, eta_c=15.0, m=1.0 / variables, eta_m=20.0, seed=seed)
    )
    members = algorithm.evolve(members)
    seconds = time.perf_counter() - start
    return seconds, members.get_f()


def pymoo_run(problem, population, evaluations, seed):
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.operators.mutation.pm import PM
    from pymoo.optimize import minimize
    from pymoo.problems import get_problem

    posed = get_problem(problem, n_var=12, n_obj=3) if problem == "dtlz2" else get_problem(problem, n_var=30)
    algorithm = NSGA2(pop_size=population, crossover=SBX(prob=0.9, eta=15), mutation=PM(eta=20))
    start = time.perf_counter()
    result = minimize(posed, algorithm, ("n_eval", evaluations), seed=seed)
    seconds = time.perf_counter() - start
    return seconds, result.pop.get("F")


def pymoo_nsga3_run(problem, population, evaluations, seed):
    from pymoo.algorithms.moo.nsga3 import NSGA3
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.operators.mutation.pm import PM
    from pymoo.optimize import minimize
    from pymoo.problems import get_problem
    from pymoo.util.ref_dirs import get_reference_directions

    # dtlz2_5 has 5 objectives and 14 variables. The spread of reference directions is the finest that the population
    # serves.
    objectives = int(problem.rsplit("_", 1)[1])
    partitions = {3: 12, 5: 6}[objectives]
    directions = get_reference_directions("das-dennis", objectives, n_partitions=partitions)
    posed = get_problem("dtlz2", n_var=objectives + 9, n_obj=objectives)
    algorithm = NSGA3(
        pop_size=population, ref_dirs=directions, crossover=SBX(prob=0.9, eta=15), mutation=PM(eta=20)
    )
    start = time.perf_counter()
    result = minimize(posed, algorithm, ("n_eval", evaluations), seed=seed)
    seconds = time.perf_counter() - start
    return seconds, result.pop.get("F")


def sort(points):
    from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance, get_crowding_function
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    points = np.array(points, dtype=float)
    fronts = [sorted(int(i) for i in front) for front in NonDominatedSorting().do(points)]
    # Given as a function, it is asked with copies of a point left aside; by name it would count them.
    crowd = get_crowding_function(calc_crowding_distance)
    crowding = [crowd.do(points[front]) for front in fronts]
    # JSON has no infinity.
    return fronts, [[-1.0 if np.isinf(x) else float(x) for x in front] for front in crowding]


def distances(front, points):
    from pymoo.indicators.igd import IGD
    from pymoo.indicators.igd_plus import IGDPlus

    front, points = np.array(front, dtype=float), np.array(points, dtype=float)
    named = {"igd": IGD, "igd_plus": IGDPlus}
    plain = {name: float(of(front)(points)) for name, of in named.items()}
    scaled = {f"{name}_scaled": float(of(front, zero_to_one=True)(points)) for name, of in named.items()}
    return plain | scaled


for line in sys.stdin:
    request = json.loads(line)
    if "front" in request:
        print(json.dumps(distances(request["front"], request["points"])), flush=True)
    elif "points" in request:
        fronts, crowding = sort(request["points"])
        print(json.dumps({"fronts": fronts, "crowding": crowding}), flush=True)
    else:
        run = {"pygmo": pygmo_run, "pymoo": pymoo_run, "pymoo nsga3": pymoo_nsga3_run}[request["library"]]
        seconds, front = run(request["problem"], request["population"], request["evaluations"], request["seed"])
        print(json.dumps({"seconds": seconds, "front": np.asarray(front).tolist()}), flush=True)
