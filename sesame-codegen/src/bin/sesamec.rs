//! The `sesamec` command.

fn main() {}
