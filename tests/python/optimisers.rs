//! Sesame's searches under the interfaces of Optuna and pymoo, whose own searches are the judges.

use sesame_peers::named;
use sesame_tests::done;

use crate::package::{CART, Place};
use crate::results::examples;

fn checked(name: &str, program: &str) {
    let Some(python) = named("SESAME_PYTHON_PEERS") else { return };
    let Some(place) = Place::new(name, CART) else { return };
    done(&mut place.script(python, program)).expect(0);
}

#[test]
fn a_sampler_of_optuna_beats_chance_and_repeats_itself() {
    checked(
        "python_optuna",
        r#"
import statistics, optuna
from sesamec.optuna import Sampler

optuna.logging.set_verbosity(optuna.logging.WARNING)

def objective(trial):
    x = trial.suggest_float("x", -5, 5)
    y = trial.suggest_float("y", 0.01, 100, log=True)
    n = trial.suggest_int("n", 0, 20, step=2)
    arm = trial.suggest_categorical("arm", ["left", "right"])
    assert n % 2 == 0 and 0 <= n <= 20 and 0.01 <= y <= 100, trial.params
    return (x - 2) ** 2 + (y - 1) ** 2 + (n - 6) ** 2 / 10 + (arm == "left") - 1

def best(sampler, trials, direction="minimize"):
    sign = 1 if direction == "minimize" else -1
    study = optuna.create_study(sampler=sampler, direction=direction)
    study.optimize(lambda trial: sign * objective(trial), n_trials=trials)
    return sign * study.best_value, [trial.params for trial in study.trials]

for strategy, trials in (("nsga2", 120), ("falsification", 40)):
    ours = [best(Sampler(strategy, seed=seed), trials)[0] for seed in range(7)]
    chance = [best(optuna.samplers.RandomSampler(seed=seed), trials)[0] for seed in range(7)]
    assert statistics.median(ours) < statistics.median(chance), (strategy, ours, chance)
    assert best(Sampler(strategy, seed=3), 30) == best(Sampler(strategy, seed=3), 30)
# A maximum is found like a minimum, and trials that fail do not stop a search.
assert best(Sampler(seed=3), 60, "maximize") == best(Sampler(seed=3), 60)
study = optuna.create_study(sampler=Sampler("nsga3", population=8), directions=["minimize", "maximize"])

def fails_at_times(trial):
    x, y = trial.suggest_float("x", 0, 1), trial.suggest_float("y", 0, 1)
    if trial.number % 5 == 4:
        raise ArithmeticError
    return x + y, x - y

study.optimize(fails_at_times, n_trials=60, catch=ArithmeticError)
assert len(study.best_trials) > 3
study = optuna.create_study(sampler=Sampler(population=8))
study.optimize(objective, n_trials=60, n_jobs=3)
assert len(study.trials) == 60
"#,
    );
}

#[test]
fn an_algorithm_of_pymoo_is_as_good_as_pymoos_own() {
    checked(
        "python_pymoo",
        r#"
import statistics
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.indicators.hv import HV
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from sesamec.pymoo import NSGA

problem, volume = get_problem("zdt1"), HV(ref_point=[1.1, 1.1])

def volumes(algorithm):
    return [volume(minimize(problem, algorithm(pop_size=40), ("n_gen", 150), seed=seed).F) for seed in range(5)]

ours, theirs = volumes(NSGA), volumes(NSGA2)
assert statistics.median(ours) > 0.97 * statistics.median(theirs), (ours, theirs)
again = minimize(problem, NSGA(pop_size=40), ("n_gen", 150), seed=3)
assert volume(again.F) == ours[3] and again.algorithm.evaluator.n_eval == 6000
# Infeasible solutions do not survive beside feasible ones, and three objectives are searched by reference points.
assert (minimize(get_problem("bnh"), NSGA(pop_size=20), ("n_gen", 20), seed=1).G <= 0).all()
assert minimize(get_problem("dtlz2"), NSGA(pop_size=36, reference_points=True), ("n_gen", 30), seed=1).F.shape[1] == 3
"#,
    );
}

#[test]
fn the_examples_of_the_page_on_optimisers_run() {
    checked("python_optimisers", &examples("python-optimisers.md", "python").concat());
}
