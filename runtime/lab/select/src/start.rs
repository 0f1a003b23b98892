//! Good choices to begin with: greedy ones from several first tests, improved by exchanging one test for another.

use crate::instance::Instance;

/// How many first tests are tried.
const STARTS: usize = 8;

/// Good choices of an instance, the best first; none if no choice of this size is cheap enough or none was found.
pub(crate) fn choices(instance: &mut Instance) -> Vec<Vec<usize>> {
    let mut found: Vec<(f64, Vec<usize>)> = Vec::new();
    for first in firsts(instance) {
        let Some(mut chosen) = greedy(instance, first) else { continue };
        improve(instance, &mut chosen);
        if !found.iter().any(|(_, other)| *other == chosen) {
            found.push((instance.value(&chosen), chosen));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    found.into_iter().map(|(_, chosen)| chosen).collect()
}

/// Tests to begin with: none, then in turn the best by itself and the farthest from those before it.
fn firsts(instance: &mut Instance) -> Vec<Option<usize>> {
    let mut firsts = vec![None];
    let count = instance.len();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| instance.own(b).total_cmp(&instance.own(a)).then(a.cmp(&b)));
    firsts.extend(order.first().map(|&at| Some(at)));
    let mut nearest = vec![f64::INFINITY; count];
    let mut last = order.first().copied();
    while let Some(at) = last.filter(|_| firsts.len() < STARTS) {
        for (nearest, distance) in nearest.iter_mut().zip(instance.row(at)) {
            *nearest = nearest.min(*distance);
        }
        nearest[at] = f64::NEG_INFINITY;
        last = (0..count).filter(|&at| nearest[at] > 0.0).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]));
        firsts.extend(last.map(Some));
    }
    firsts
}

/// The forced tests, the first, and then always the test that adds the most.
fn greedy(instance: &mut Instance, first: Option<usize>) -> Option<Vec<usize>> {
    let count = instance.len();
    let mut chosen: Vec<usize> = (0..count).filter(|&at| instance.forced[at]).collect();
    let mut money = instance.limit - chosen.iter().map(|&at| instance.cost[at]).sum::<f64>();
    let mut by_cost: Vec<usize> = (0..count).filter(|&at| !instance.forced[at]).collect();
    by_cost.sort_by(|&a, &b| instance.cost[a].total_cmp(&instance.cost[b]).then(a.cmp(&b)));
    let mut taken = instance.forced.clone();
    let mut gain: Vec<f64> = (0..count).map(|at| instance.own(at)).collect();
    for &at in &chosen {
        add(&mut gain, instance.row(at), 1.0);
    }
    let mut first = first;
    while chosen.len() < instance.size {
        let others = instance.size - chosen.len() - 1;
        // What the others cost at least: if one of the cheapest is taken itself, the next one counts instead.
        let cheapest: Vec<usize> = by_cost.iter().copied().filter(|&at| !taken[at]).take(others + 1).collect();
        if cheapest.len() <= others {
            return None;
        }
        let all: f64 = cheapest.iter().map(|&at| instance.cost[at]).sum();
        let dearest = instance.cost[cheapest[others]];
        let fits = |at: usize| {
            let rest = if instance.cost[at] <= dearest { all - instance.cost[at] } else { all - dearest };
            instance.cost[at] + rest <= money
        };
        let wished = first.take().filter(|&at| !taken[at] && fits(at));
        let best = wished.or_else(|| {
            let free = (0..count).filter(|&at| !taken[at] && fits(at));
            free.max_by(|&a, &b| gain[a].total_cmp(&gain[b]).then(b.cmp(&a)))
        })?;
        taken[best] = true;
        money -= instance.cost[best];
        chosen.push(best);
        add(&mut gain, instance.row(best), 1.0);
    }
    chosen.sort_unstable();
    Some(chosen)
}

/// Exchanges the pair of tests that gains the most until no exchange gains anything. Keeps the order of positions.
pub(crate) fn improve(instance: &mut Instance, chosen: &mut [usize]) {
    let count = instance.len();
    let mut inside = vec![false; count];
    let mut gain: Vec<f64> = (0..count).map(|at| instance.own(at)).collect();
    for &at in chosen.iter() {
        inside[at] = true;
        add(&mut gain, instance.row(at), 1.0);
        // A test has no distance to itself, whatever the diagonal says.
        gain[at] -= instance.diagonal(at);
    }
    let cost = instance.cost.clone();
    let mut money = instance.limit - chosen.iter().map(|&at| cost[at]).sum::<f64>();
    let least = 1e-12 * gain.iter().fold(0.0, |most: f64, gain| most.max(gain.abs())) * chosen.len() as f64;
    loop {
        let mut best = (least, usize::MAX, usize::MAX);
        for (place, &out) in chosen.iter().enumerate() {
            if instance.forced[out] {
                continue;
            }
            let room = money + instance.cost[out];
            let lost = gain[out];
            let row = instance.row(out);
            for at in 0..count {
                let gained = gain[at] - row[at] - lost;
                if gained > best.0 && !inside[at] && cost[at] <= room {
                    best = (gained, place, at);
                }
            }
        }
        let (_, place, at) = best;
        if at == usize::MAX {
            break;
        }
        let out = std::mem::replace(&mut chosen[place], at);
        (inside[out], inside[at]) = (false, true);
        money += instance.cost[out] - instance.cost[at];
        add(&mut gain, instance.row(at), 1.0);
        gain[at] -= instance.diagonal(at);
        add(&mut gain, instance.row(out), -1.0);
        gain[out] += instance.diagonal(out);
    }
    chosen.sort_unstable();
}

fn add(gain: &mut [f64], row: &[f64], times: f64) {
    for (gain, distance) in gain.iter_mut().zip(row) {
        *gain += times * distance;
    }
}
