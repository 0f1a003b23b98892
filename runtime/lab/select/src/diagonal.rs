//! The diagonal that makes the relaxation tight.
//!
//! For 0-1 vectors `x² = x`, so a diagonal `u` of the matrix can be paid for by the linear part. Between 0 and 1 the
//! objective becomes smaller by `½ Σ u y (1 − y)`, and so do the bounds, as long as it remains concave on vectors of
//! one sum [Billionnet and Elloumi 2007]. The best `u` for the fractions at hand is that of a semidefinite program:
//! maximise `Σ w u` with `w = y (1 − y)`, where `P = ρ11' − A − diag u` is positive semidefinite. It is solved by
//! coordinate ascent with a barrier: with `S = P⁻¹`, the maximum of `Σ w u + ε log det P` along one coordinate is at
//! `1 / Sᵢᵢ − ε / wᵢ`, and each step changes `S` by a matrix of rank one. `u` is kept from becoming negative, so that
//! no other fractions have a worse bound than without it. Whatever comes out is checked by a factorisation before it
//! is used, so rounding cannot make a bound wrong.

use crate::instance::Instance;
use crate::subproblem::Subproblem;

/// With more free tests, the work grows beyond what the bounds gain.
const MOST: usize = 240;
/// The least number of parts before that.
const PARTS: usize = 16;
/// The work for one part, as a share of the cubed number of tests that the diagonal costs.
const COST: usize = 2_000;
/// Passes over all coordinates; the barrier becomes smaller with each.
const PASSES: i32 = 8;
/// By how much.
const SHRINK: f64 = 0.35;
/// The least weight of a test, as a share of the greatest possible one: fractions change from part to part.
const LEAST: f64 = 0.01;

/// After this many parts of a search, a better diagonal is worth its work: about as much was done for the parts.
pub(crate) fn patience(free: usize) -> usize {
    PARTS.max(free.pow(3) / COST)
}

/// Chooses the diagonal of an instance for a part of it that contains all others which are looked at from now on: what
/// is not free in it is free in none. Returns whether the diagonal changed.
pub(crate) fn tighten(instance: &mut Instance, part: &Subproblem, free: &[usize]) -> bool {
    if free.len() < 3 || free.len() > MOST || part.left(instance) < 2 {
        return false;
    }
    let weights: Vec<f64> = free.iter().map(|&at| part.fraction[at]).map(|y| LEAST + y * (1.0 - y)).collect();
    let pairs = free.iter().flat_map(|&one| free.iter().map(move |&other| (one, other)));
    let distances: Vec<f64> =
        pairs.map(|(one, other)| if one == other { 0.0 } else { instance.pair(one, other) }).collect();
    let Some(diagonal) = best(&distances, &weights) else { return false };
    let mut all = vec![0.0; instance.len()];
    for (&at, value) in free.iter().zip(diagonal) {
        all[at] = value;
    }
    instance.set_diagonal(all);
    true
}

/// The diagonal for these distances, if there is one that helps.
fn best(distances: &[f64], weights: &[f64]) -> Option<Vec<f64>> {
    let count = weights.len();
    let greatest = distances.iter().copied().fold(0.0, f64::max);
    if greatest <= 0.0 {
        return None;
    }
    // Slightly negative, so that duplicates, too, leave the matrix positive definite.
    let least = -1e-5 * greatest;
    let mut diagonal = vec![least; count];
    let rho = [4.0, 32.0, 256.0].map(|times| times * greatest);
    let rho = rho.into_iter().find(|&rho| factor(&matrix(distances, &diagonal, rho), count).is_some())?;
    let mut inverse = inverse(&factor(&matrix(distances, &diagonal, rho), count)?, count);
    let mut barrier = (0..count).map(|at| weights[at] / inverse[at * count + at]).fold(0.0, f64::max);
    for _ in 0..PASSES {
        barrier *= SHRINK;
        for at in 0..count {
            let own = inverse[at * count + at];
            let step = (1.0 / own - barrier / weights[at]).max(least - diagonal[at]);
            if !step.is_finite() || own <= 0.0 {
                return None;
            }
            diagonal[at] += step;
            let times = step / (1.0 - step * own);
            let row: Vec<f64> = inverse[at * count..(at + 1) * count].to_vec();
            for (line, factor) in inverse.chunks_mut(count).zip(&row) {
                let factor = times * factor;
                for (value, other) in line.iter_mut().zip(&row) {
                    *value += factor * other;
                }
            }
        }
    }
    let gained: f64 = diagonal.iter().zip(weights).map(|(u, w)| u * w).sum();
    // A margin, so that rounding in what is computed with it is of no account.
    for value in &mut diagonal {
        *value -= 1e-7 * greatest;
    }
    (gained > 0.0 && factor(&matrix(distances, &diagonal, rho), count).is_some()).then_some(diagonal)
}

/// `ρ11' − A − diag u`.
fn matrix(distances: &[f64], diagonal: &[f64], rho: f64) -> Vec<f64> {
    let count = diagonal.len();
    let mut matrix: Vec<f64> = distances.iter().map(|distance| rho - distance).collect();
    for (at, value) in diagonal.iter().enumerate() {
        matrix[at * count + at] = rho - value;
    }
    matrix
}

/// The lower triangle of Cholesky's factorisation, if the matrix is positive definite beyond doubt.
fn factor(matrix: &[f64], count: usize) -> Option<Vec<f64>> {
    let mut lower = vec![0.0; matrix.len()];
    for row in 0..count {
        for column in 0..=row {
            let (one, other) = (&lower[row * count..][..column], &lower[column * count..][..column]);
            let rest = matrix[row * count + column] - one.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            if row == column {
                if rest <= 1e-12 * matrix[row * count + row].abs() {
                    return None;
                }
                lower[row * count + row] = rest.sqrt();
            } else {
                lower[row * count + column] = rest / lower[column * count + column];
            }
        }
    }
    Some(lower)
}

/// The inverse of the matrix with this factor.
fn inverse(lower: &[f64], count: usize) -> Vec<f64> {
    // The inverse of the factor, row by row, then its transpose times itself.
    let mut below = vec![0.0; lower.len()];
    for row in 0..count {
        let mut line = vec![0.0; count];
        line[row] = 1.0;
        for column in 0..row {
            let factor = lower[row * count + column];
            for (value, other) in line[..=column].iter_mut().zip(&below[column * count..]) {
                *value -= factor * other;
            }
        }
        let own = lower[row * count + row];
        for (value, computed) in below[row * count..].iter_mut().zip(&line[..=row]) {
            *value = computed / own;
        }
    }
    let mut inverse = vec![0.0; lower.len()];
    for row in below.chunks(count) {
        for (at, factor) in row.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
            for (value, other) in inverse[at * count..(at + 1) * count].iter_mut().zip(row) {
                *value += factor * other;
            }
        }
    }
    inverse
}
