"""What SciPy, statsmodels and dtaidistance make of samples, shares and series.

Reads questions, one JSON object per line, and answers each with one line: a JSON list of numbers, in the order in which
the functions below return them.
"""

import json
import sys

import numpy as np
from dtaidistance import dtw
from scipy import integrate, special, stats
from statsmodels.stats.meta_analysis import combine_effects
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.oneway import anova_oneway
from statsmodels.stats.proportion import proportion_confint
from statsmodels.stats.weightstats import CompareMeans, DescrStatsW


def samples(simulation, lab, tolerance, alpha):
    # The lab first, so that its greater values are positive differences.
    means = CompareMeans(DescrStatsW(lab), DescrStatsW(simulation))
    low, high = means.tconfint_diff(alpha=2 * alpha, usevar="unequal")
    _, (above, below) = means.ttost_ind(-tolerance, tolerance, usevar="unequal")
    welch = stats.ttest_ind(lab, simulation, equal_var=False)
    degrees = len(simulation) + len(lab) - 2
    d = stats.ttest_ind(lab, simulation).statistic * np.sqrt(1 / len(lab) + 1 / len(simulation))
    factor = special.gamma(degrees / 2) / special.gamma((degrees - 1) / 2) / np.sqrt(degrees / 2)
    u = stats.mannwhitneyu(lab, simulation).statistic
    delta = 2 * u / (len(simulation) * len(lab)) - 1
    return [welch.df, welch.pvalue, low, high, above[1], below[1], d, d * factor, delta]


def bootstrap(simulation, lab):
    def difference(lab, simulation, axis):
        return np.mean(lab, axis=axis) - np.mean(simulation, axis=axis)

    ends = []
    for method in ["BCa", "percentile"]:
        found = stats.bootstrap((lab, simulation), difference, n_resamples=10_000, method=method, random_state=1)
        ends += found.confidence_interval
    return ends


def power(deviations, runs, tolerance, alpha):
    # Phillips 1990, with Satterthwaite's degrees of freedom.
    a, b = (deviation**2 / count for deviation, count in zip(deviations, runs))
    degrees = (a + b) ** 2 / (a**2 / (runs[0] - 1) + b**2 / (runs[1] - 1))
    bound, t = tolerance / np.sqrt(a + b), stats.t.ppf(1 - alpha, degrees)

    def density(chi):
        return (1 - 2 * stats.norm.cdf(t * chi / np.sqrt(degrees) - bound)) * stats.chi.pdf(chi, degrees)

    return [integrate.quad(density, 0, bound / t * np.sqrt(degrees), limit=500)[0]]


def holm(p):
    return multipletests(p, method="holm")[1]


def shares(a, b):
    table = [[a[0], a[1] - a[0]], [b[0], b[1] - b[0]]]
    return [stats.fisher_exact(table).pvalue, *proportion_confint(a[0], a[1], method="wilson")]


def warping(a, b, band):
    # Its window counts the diagonal.
    return [dtw.distance(np.array(a), np.array(b), window=band + 1)]


def pooled(differences, errors):
    found = combine_effects(np.array(differences), np.array(errors) ** 2, use_t=False)
    return [found.mean_effect_fe, found.sd_eff_w_fe, found.q, max(found.i2, 0)]


def means(samples):
    found = anova_oneway(samples, use_var="unequal", welch_correction=True)
    return [found.pvalue]


ANSWERS = {of.__name__: of for of in [samples, bootstrap, power, holm, shares, warping, pooled, means]}

for line in sys.stdin:
    question = json.loads(line)
    answer = ANSWERS[question.pop("ask")](**question)
    print(json.dumps([float(number) for number in answer]), flush=True)
