//! Behaviour across crates, as a user meets it.
#![cfg(test)]

mod a50_cell;
mod bugs;
mod building;
mod choice;
mod commands;
mod common_cause;
mod compensation;
mod conditions;
mod confirm;
mod constants;
mod coverage;
mod custom;
mod declarative;
mod disk;
mod emitted;
mod emitted_process;
mod exported;
mod expressions;
mod falsification;
mod faults;
mod first_front;
mod free_running;
mod gap;
mod hostile;
mod import;
#[cfg(unix)]
mod interpreted;
mod interruption;
#[cfg(target_os = "linux")]
mod killed;
mod kuka_cell;
mod lab_safety;
mod large_results;
mod latest;
#[cfg(unix)]
mod messages;
mod monitor_alone;
mod monitors;
#[cfg(unix)]
mod nodes;
mod optimisers;
mod optional;
mod physical;
mod preparation;
mod random_models;
mod regeneration;
#[cfg(unix)]
mod scenes;
mod search;
mod select;
mod served;
mod shrink;
mod stl;
mod strategies;
mod tampering;
mod traces;
mod transport;
mod unheard;
mod unwritable_output;
mod vendored;
mod verification;
