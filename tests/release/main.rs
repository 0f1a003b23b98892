//! What a release is made of, and what `./release` makes of it: the wheel, the archives, the Debian package and the
//! image are installed and used without Rust.
#![cfg(test)]

mod action;
mod files;
mod gitlab;
mod installed;
mod manifests;
mod materials;
mod steps;
