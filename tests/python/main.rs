//! Simulators, metrics and operations in Python, in the processes that run tests: the package is put together from its
//! files and the module that cargo has built, and users' programs import it.

mod both_ways;
mod debugging;
mod hooks;
mod interruption;
mod notebook;
mod optimisers;
mod package;
mod pytest;
mod results;
mod search;
mod stubs;
