//! The `sesamec` command.

fn main() -> std::process::ExitCode {
    sesamec::cli::main(&sesamec::frontend::SESAME)
}
