//! Campaigns whose tests agents run: several processes on this machine stand for several machines, with a folder or a
//! real broker of NATS between them.
//!
//! `./test` makes an environment with the broker and names it in `SESAME_NATS`. Without it, tests with a broker say
//! that they are skipped, and fail with `CI=true`.

mod campaigns;
mod chaos;
mod documented;
mod fleet;
mod network;
mod promises;
mod refusals;
mod slurm;
mod times;
