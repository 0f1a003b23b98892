//! The `sesamec` command.

fn main() -> std::process::ExitCode {
    sesame_codegen::cli::main(&sesame_codegen::frontend::SESAME)
}
