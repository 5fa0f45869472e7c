//! The program `unlift`.

use std::process::ExitCode;

fn main() -> ExitCode {
    let program = std::env::current_exe().unwrap_or_default();
    unlift_cli::run(program, std::env::args_os().collect()).into()
}
