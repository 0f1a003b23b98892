//! The choice with the smallest numbers among choices of equal value.

use crate::incumbent::{Incumbent, TOLERANCE};
use crate::size::Size;
use crate::subproblem::Fate;
use crate::tree::Search;

/// Replaces a choice of the proved value by the one with the smallest numbers that has the same value. Returns false if
/// the search was stopped before that was settled.
///
/// It goes through the numbers in their order and asks for each that the choice so far does without: is there a choice
/// of this value that has the same numbers before it, and then this one?
pub(crate) fn smallest(sizes: &mut [Size], search: &mut Search<'_>, best: &mut Vec<usize>) -> bool {
    let value = search.incumbent.value;
    let goal = value * (1.0 - TOLERANCE);
    for size in sizes {
        if size.bound < goal || size.root.is_none() {
            continue;
        }
        if !size.reduce_to(search, goal) {
            return false;
        }
        let Some(root) = size.root.clone() else { continue };
        let mut part = root;
        let mut place = 0;
        for at in 0..size.instance.len() {
            if place == size.instance.size {
                break;
            }
            let name = size.instance.names[at];
            // Whatever is as long and begins with greater numbers is not smaller.
            let prefix = part_names(size, &part.inside, at);
            if prefix[..] > best[..prefix.len().min(best.len())] {
                break;
            }
            if part.fate[at] == Fate::Out {
                continue;
            }
            let own = best.len() == size.instance.size && best[..place] == prefix[..];
            if part.fate[at] == Fate::In || (own && best[place] == name) {
                if part.fate[at] == Fate::Free && !part.put_in(&mut size.instance, at) {
                    break;
                }
                place += 1;
                continue;
            }
            if own && name > best[place] {
                break;
            }
            let mut with = part.clone();
            search.incumbent = Incumbent::default();
            search.goal = Some(goal);
            with.bound = f64::INFINITY;
            if with.put_in(&mut size.instance, at) {
                let open = search.explore(&mut size.instance, with.clone());
                let found = search.incumbent.choice().cloned().filter(|_| search.incumbent.value >= goal);
                search.goal = None;
                search.incumbent.value = value;
                if let Some(found) = found {
                    if found < *best {
                        *best = found;
                    }
                    part = with;
                    part.bound = f64::INFINITY;
                    place += 1;
                    continue;
                }
                if open > f64::NEG_INFINITY {
                    return false;
                }
            }
            search.goal = None;
            search.incumbent.value = value;
            if !part.put_out(&mut size.instance, at) {
                break;
            }
        }
    }
    true
}

/// The numbers before a position that are in.
fn part_names(size: &Size, inside: &[usize], before: usize) -> Vec<usize> {
    let mut names: Vec<usize> = inside.iter().filter(|&&at| at < before).map(|&at| size.instance.names[at]).collect();
    names.sort_unstable();
    names
}
